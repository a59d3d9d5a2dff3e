// SPDX-License-Identifier: LGPL-2.1-or-later
// L(t) as real pictures: the temporal model, its 8-bit evaluation, and what is foreground.
#include "core/model/background_model.h"

#include <map>
#include <set>

#include "core/dmd/decompose.h"
#include "core/dmd/qdmd.h"
#include "core/foreground/foreground.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// W, 3m x n: row 3 t + c is channel c of snapshot t.
Eigen::MatrixXd planes_of(const Clip& clip) {
  Eigen::MatrixXd w(3 * clip.size(), clip.pixels);
  for (size_t t = 0; t < clip.size(); ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < clip.pixels; ++p)
        w(static_cast<Eigen::Index>(3 * t + c), static_cast<Eigen::Index>(p)) = clip.at(t, c, p);
  return w;
}

TemporalModel model_of(const QuaternionMatrixd& combination, std::complex<double> lambda,
                       const Quaterniond& amplitude) {
  TemporalModel model(static_cast<int>(combination.rows()));
  model.add_mode(combination, lambda, 0, amplitude);
  return model;
}

// All weight on snapshot 0 of one, times a real factor.
TemporalModel scaled_snapshot(double factor) {
  QuaternionMatrixd one(1, 1);
  one.a(0, 0) = 1;
  return model_of(one, 1.0, Quaterniond(factor));
}

DmdOptions every_mode(double threshold) {
  DmdOptions options;
  options.omega_threshold = threshold;
  return options;
}

// L at every pixel of a built model, three planes.
std::vector<uint8_t> evaluate(const BackgroundModel& model, size_t pixels) {
  std::vector<uint8_t> out(3 * pixels);
  for (size_t first = 0; first < pixels; first += kMaxRun) {
    uint8_t* const rows[3] = {out.data() + first, out.data() + pixels + first,
                              out.data() + 2 * pixels + first};
    model.evaluate(first, std::min(kMaxRun, pixels - first), rows);
  }
  return out;
}

// ---- TemporalModel ----

TEST(TemporalModel, EqualsQuaternionArithmetic) {
  std::mt19937 rng(101);
  const Clip clip = random_clip(20, 5, rng);
  const auto x = to_quaternions(clip);
  BackgroundModes modes;
  modes.combination = random_matrix(5, 3, rng);
  modes.amplitudes = random_matrix(3, 1, rng);
  modes.eigenvalues = Eigen::VectorXcd{{{0.6, 0.7}, 1.1, {-0.4, 0.2}}};
  modes.reference_times = Eigen::VectorXd{{0, 4, 0}};
  TemporalModel model(5);
  for (int p = 0; p < 3; ++p)
    model.add_mode(modes.combination.col(p), modes.eigenvalues(p), modes.reference_times(p),
                   modes.amplitudes.get(p, 0));
  EXPECT_EQ(model.picture_count(), 12);
  const Eigen::MatrixXd pictures = model.basis() * planes_of(clip);
  for (int t = -2; t < 8; ++t) {
    const Eigen::MatrixXd actual = model.weights(t) * pictures;
    const auto expected = background_at(x, modes, t);
    double worst = 0;
    for (int p = 0; p < 20; ++p) {
      const auto q = expected.get(p, 0);
      worst = std::max(worst, (actual.col(p) - Eigen::Vector3d(q.x, q.y, q.z)).norm());
    }
    // 15 snapshots' planes and three modes of weights up to some 10 lambda^t.
    const double growth = std::pow(0.45, std::min(t, 0)) * std::pow(1.1, std::max(t, 0));
    EXPECT_LE(worst, 1000 * kEpsilon * 255 * growth) << t;
  }
}

// phi z lambda^t z^-1 b: any complex z, and any quaternion where lambda is real.
TEST(TemporalModel, PicturesDoNotDependOnTheModesPhase) {
  std::mt19937 rng(106);
  const auto combination = random_matrix(5, 1, rng);
  const Quaterniond amplitude(0.5, -2, 0.75, 1.5);
  const auto expect_same = [&](std::complex<double> lambda, const Quaterniond& phase) {
    auto turned = combination;
    turned.scale_col(0, phase);
    const auto one = model_of(combination, lambda, amplitude);
    const auto other = model_of(turned, lambda, phase.inverse() * amplitude);
    // Two products of quaternions of four terms each, beside those of the model.
    EXPECT_LE((one.basis() - other.basis()).cwiseAbs().maxCoeff(),
              32 * kEpsilon * one.basis().cwiseAbs().maxCoeff());
    for (double t : {-1.0, 0.0, 2.5})
      EXPECT_LE((one.weights(t) - other.weights(t)).cwiseAbs().maxCoeff(),
                32 * kEpsilon * one.weights(t).cwiseAbs().maxCoeff());
  };
  expect_same({0.9, 0.4}, Quaterniond(0.6, 0.8, 0, 0));
  expect_same({0.9, 0.4}, Quaterniond(0, -1, 0, 0));
  expect_same(0.98, Quaterniond(0.5, -0.5, 0.5, 0.5));
}

TEST(TemporalModel, TakesAnyTime) {
  QuaternionMatrixd one(1, 1);
  one.a(0, 0) = 1;
  const auto model = model_of(one, {0, 1}, Quaterniond(1.0));
  // x e^(i pi/4) for x = i: -sin + i cos.
  const Eigen::MatrixXd l = model.weights(0.5) * model.basis() * Eigen::Vector3d(1, 0, 0);
  EXPECT_NEAR(l(0, 0), std::sqrt(0.5), 4 * kEpsilon);
}

TEST(TemporalModel, ChannelModesTouchTheirChannelOnly) {
  std::mt19937 rng(102);
  const Clip clip = random_clip(20, 4, rng);
  const Eigen::MatrixXd w = planes_of(clip);
  const Eigen::VectorXcd combination = Eigen::VectorXcd::Random(4);
  const std::complex<double> lambda(0.5, 0.6), amplitude(-1.5, 0.25);
  for (int channel = 0; channel < 3; ++channel)
    for (bool real : {false, true}) {
      const Eigen::VectorXcd used =
          real ? Eigen::VectorXcd(combination.real().cast<std::complex<double>>()) : combination;
      TemporalModel model(4);
      model.add_channel_mode(channel, used, lambda, 0, amplitude);
      EXPECT_EQ(model.picture_count(), real ? 1 : 2);
      for (int t : {0, 1, 3, 7}) {
        const Eigen::MatrixXd l = model.weights(t) * model.basis() * w;
        Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(3, 20);
        for (int s = 0; s < 4; ++s)
          expected.row(channel) +=
              (used(s) * integer_power(lambda, t) * amplitude).real() * w.row(3 * s + channel);
        // Four terms of weights below 3.
        EXPECT_LE((l - expected).cwiseAbs().maxCoeff(), 64 * kEpsilon * 255 * 3);
      }
    }
}

TEST(TemporalModel, WithoutModesIsZero) {
  const TemporalModel model(6);
  EXPECT_EQ(model.picture_count(), 0);
  EXPECT_EQ(model.weights(3).rows(), 3);
  EXPECT_EQ(model.weights(3).cols(), 0);
  EXPECT_EQ(model.basis().cols(), 18);
}

TEST(TemporalModel, GrowthSaturates) {
  std::mt19937 rng(103);
  const auto combination = random_matrix(3, 1, rng);
  for (double t : {1e3, 1e9, -1e9}) {
    const auto model = model_of(combination, t > 0 ? 3.0 : 0.3, random_quaternion(rng));
    EXPECT_TRUE(model.weights(t).allFinite());
    EXPECT_GE(model.weights(t).cwiseAbs().maxCoeff(), 1e6) << "far above a picture";
  }
}

// ---- BackgroundModel ----

// Levels have to be within a rounding (a half) and `slack` of the clamped exact picture.
double worst_deviation(const BackgroundModel& model, const Clip& clip,
                       const TemporalModel& temporal, int t) {
  const auto levels = evaluate(model, clip.pixels);
  const Eigen::MatrixXd exact = temporal.weights(t) * temporal.basis() * planes_of(clip);
  double worst = 0;
  for (size_t c = 0; c < 3; ++c)
    for (size_t p = 0; p < clip.pixels; ++p) {
      const double l = exact(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(p));
      const double deviation = std::abs(levels[c * clip.pixels + p] - std::clamp(l, 0.0, 255.0));
      if (!(deviation <= worst)) worst = deviation;
    }
  return worst;
}

// A model's L(t) in twice the pictures that a window of m snapshots keeps as pictures.
TemporalModel with_idle_modes(TemporalModel model, int snapshots) {
  const QuaternionMatrixd nothing(snapshots, 1);
  while (4 * model.picture_count() <= 6 * snapshots)
    model.add_mode(nothing, 1.0, 0, Quaterniond(1.0));
  return model;
}

TEST(BackgroundModel, PicturesAndDirectPathEqualTheDoubleEvaluation) {
  std::mt19937 rng(104);
  // More than two runs of pixels, and not a multiple.
  const size_t pixels = 2 * kMaxRun + 77;
  const std::vector<Clip> all = {noisy_clip(pixels, 24, 3, rng), noisy_clip(pixels, 24, 25, rng),
                                 colour_rotating_clip(pixels, 24, 0.25, 1, rng),
                                 drifting_clip(pixels, 24, 0.004, rng)};
  for (size_t i = 0; i < all.size(); ++i) {
    const Clip& clip = all[i];
    const Window window = to_window(clip);
    const auto gram = gram_of(window);
    // One mode, a few, nearly all.
    for (double threshold : {0.0, 0.3, 1.0, kInfinity}) {
      SCOPED_TRACE("clip " + std::to_string(i) + ", threshold " + std::to_string(threshold));
      const auto temporal = decompose(window, gram, every_mode(threshold)).background;
      const auto idle = with_idle_modes(temporal, 24);
      BackgroundModel pictures, direct;
      pictures.build(window, temporal);
      direct.build(window, idle);
      for (int t : {0, 11, 23}) {
        pictures.set_time(t);
        direct.set_time(t);
        // Half a level of rounding to 8 bits, and another half at most for single precision.
        EXPECT_LE(worst_deviation(pictures, clip, temporal, t), 1) << t;
        EXPECT_LE(worst_deviation(direct, clip, temporal, t), 1) << t;
        const auto a = evaluate(pictures, pixels), b = evaluate(direct, pixels);
        int largest = 0;
        for (size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(a[k] - b[k]));
        EXPECT_LE(largest, 1) << t;
      }
    }
  }
}

TEST(BackgroundModel, RoundsToNearestAndClamps) {
  Clip clip(256, 1);
  for (size_t c = 0; c < 3; ++c)
    for (size_t p = 0; p < 256; ++p) clip.at(0, c, p) = static_cast<uint8_t>(p);
  const Window window = to_window(clip);
  for (double factor : {1.0, 0.3, 2.0, -1.0, 1e6, 0.0}) {
    BackgroundModel model;
    model.build(window, scaled_snapshot(factor));
    model.set_time(0);
    const auto levels = evaluate(model, 256);
    for (size_t p = 0; p < 256; ++p)
      EXPECT_EQ(levels[p], std::lround(std::clamp(factor * static_cast<double>(p), 0.0, 255.0)))
          << factor << " * " << p;
  }
}

// In more light, R, G and B of a background in Y, U and V end: pixel by pixel, in double.
TEST(BackgroundModel, ColoursEndWhereTheSensorDoes) {
  constexpr size_t kPixels = 900;
  std::mt19937 rng(112);
  const Clip clip = random_clip(kPixels, 1, rng);
  const Window window = to_window(clip);
  const Levels video = {{16, 128, 128}, {235, 128, 128}};
  const RgbColours rgb(Colours::yuv, video);
  const SampleRange range = rgb.range(video);
  for (const Gain& gain : {Gain{1.4f, 1.4f, 1.4f}, {1.2f, 1, 0.8f}, {1.01f, 1.01f, 1.01f}}) {
    BackgroundModel model;
    model.set_samples(rgb, range);
    model.build(window, scaled_snapshot(1));
    model.set_light(gain);
    model.set_time(0);
    const auto levels = evaluate(model, kPixels);
    std::vector<uint16_t> deep(3 * kPixels);
    for (size_t first = 0; first < kPixels; first += kMaxRun) {
      uint16_t* const rows[3] = {&deep[first], &deep[kPixels + first], &deep[2 * kPixels + first]};
      model.evaluate_deep(first, std::min(kMaxRun, kPixels - first), rows);
    }
    const SampleLight light(gain, range);
    size_t clipped = 0;
    for (size_t p = 0; p < kPixels; ++p) {
      double sample[3], of_rgb[3];
      for (size_t c = 0; c < 3; ++c) {
        const double dark = range.dark[c];
        sample[c] = static_cast<double>(light.gain[c]) * (clip.at(0, c, p) - dark) + dark +
                    static_cast<double>(light.tint[c]);
      }
      bool ends = false;
      for (size_t c = 0; c < 3; ++c) {
        of_rgb[c] = static_cast<double>(rgb.offset()[c]);
        for (size_t k = 0; k < 3; ++k)
          of_rgb[c] += static_cast<double>(rgb.matrix()[c][k]) * sample[k];
        ends |= of_rgb[c] > 255;
        of_rgb[c] = std::min(of_rgb[c], 255.0);
      }
      clipped += ends;
      const auto back = rgb.sample({static_cast<float>(of_rgb[0]), static_cast<float>(of_rgb[1]),
                                    static_cast<float>(of_rgb[2])});
      for (size_t c = 0; c < 3; ++c) {
        const double expected =
            std::clamp(ends ? static_cast<double>(back[c]) : sample[c], 0.0, 255.0);
        // Half a level of rounding; single precision, and six digits of the standard's matrices.
        ASSERT_NEAR(levels[c * kPixels + p], expected, 0.5 + 2e-3) << p << ' ' << ends;
        ASSERT_EQ(deep[c * kPixels + p], levels[c * kPixels + p]);
      }
    }
    EXPECT_GT(clipped, kPixels / 10);
    EXPECT_LT(clipped, kPixels);
  }
}

TEST(BackgroundModel, WithoutModesIsBlack) {
  std::mt19937 rng(106);
  const Window window = to_window(random_clip(50, 3, rng));
  BackgroundModel model;
  model.build(window, TemporalModel(3));
  model.set_time(1);
  EXPECT_EQ(evaluate(model, 50), std::vector<uint8_t>(150, 0));
}

TEST(BackgroundModel, RunsDoNotDependOnTheirStart) {
  std::mt19937 rng(107);
  const Clip clip = noisy_clip(500, 6, 10, rng);
  const Window window = to_window(clip);
  const auto gram = gram_of(window);
  for (double threshold : {0.0, kInfinity}) {  // pictures, direct
    BackgroundModel model;
    model.build(window, decompose(window, gram, every_mode(threshold)).background);
    model.set_time(2);
    const auto whole = evaluate(model, 500);
    uint8_t part[3][7];
    uint8_t* const rows[3] = {part[0], part[1], part[2]};
    model.evaluate(493, 7, rows);
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < 7; ++p) EXPECT_EQ(part[c][p], whole[c * 500 + 493 + p]);
  }
}

// L(t) of 40 frames, and how many different pictures the model says that they are.
std::pair<std::vector<std::vector<uint8_t>>, size_t> through(const TemporalModel& temporal,
                                                             const Window& window, bool steady) {
  BackgroundModel model;
  model.build(window, temporal);
  if (steady) model.make_steady();
  std::vector<std::vector<uint8_t>> all;
  std::map<uint64_t, std::vector<uint8_t>> pictures;
  for (int t = 0; t < 40; ++t) {
    model.set_time(t);
    all.push_back(evaluate(model, window.pixels()));
    EXPECT_EQ(all.back(), pictures.emplace(model.picture(), all.back()).first->second)
        << "one picture, but L is another at " << t;
  }
  return {all, pictures.size()};
}

TEST(BackgroundModel, SteadyOnesShareAPictureWhereNoLevelMoves) {
  std::mt19937 rng(112);
  // Still but for noise, and a light that falls to a half.
  for (bool fades : {false, true}) {
    Clip clip = noisy_clip(400, 40, 2, rng);
    if (fades)
      for (size_t t = 0; t < 40; ++t)
        for (auto& level : clip.frames[t])
          level = static_cast<uint8_t>(level * std::pow(0.5, static_cast<double>(t) / 40));
    const Window window = to_window(clip);
    DmdOptions options;
    options.rank = 1;
    options.amplitude = Amplitude::window;
    const auto temporal = decompose(window, gram_of(window), options).background;
    const auto [exact, many] = through(temporal, window, false);
    const auto [steady, few] = through(temporal, window, true);
    EXPECT_EQ(many, 40u);
    if (fades) {
      EXPECT_EQ(few, 40u);
      EXPECT_EQ(steady, exact);
      continue;
    }
    EXPECT_LE(few, 40u / BackgroundModel::kSteadyFrames);
    // An eighth of a level, and rounding.
    for (size_t t = 0; t < 40; ++t)
      for (size_t k = 0; k < exact[t].size(); ++k)
        EXPECT_LE(std::abs(exact[t][k] - steady[t][k]), 1) << t;
  }
}

TEST(BackgroundModel, IsAnotherPictureAfterEachChange) {
  std::mt19937 rng(113);
  const Window window = to_window(noisy_clip(100, 8, 2, rng));
  BackgroundModel model, other;
  for (BackgroundModel* one : {&model, &other}) {
    one->build(window, decompose(window, gram_of(window), every_mode(0)).background);
    one->set_time(3);
  }
  EXPECT_NE(model.picture(), other.picture());
  std::set<uint64_t> seen = {model.picture()};
  const auto is_new = [&] { return seen.insert(model.picture()).second; };
  model.set_time(3);
  EXPECT_FALSE(is_new());
  model.set_time(4);
  EXPECT_TRUE(is_new());
  model.freeze_at(4);
  EXPECT_TRUE(is_new());
  model.set_time(7);
  EXPECT_FALSE(is_new()) << "it is the same for ever";
  model.set_light({1.5, 1, 1});
  model.set_time(7);
  EXPECT_TRUE(is_new());
  const uint8_t black[2] = {};
  const uint8_t* const level[3] = {black, black, black};
  model.replace(10, 2, level);
  EXPECT_TRUE(is_new());
}

// ---- Foreground ----

TEST(AutomaticThreshold, HasAFloor) {
  EXPECT_EQ(automatic_threshold(0), 18);
  EXPECT_EQ(automatic_threshold(2), 18);
  EXPECT_NEAR(automatic_threshold(10), 40 * std::sqrt(3.0), 64 * kEpsilon);
}

// A picture with `foreground` of its pixels far off in every frame and noise on all.
ForegroundStatistics statistics_of(double sigma, double foreground, double fixed_threshold) {
  std::mt19937 rng(108);
  const size_t pixels = 6000, count = 10;
  Clip clip(pixels, count);
  std::normal_distribution<double> noise;
  for (size_t t = 0; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels; ++p) clip.set(t, c, p, 128 + sigma * noise(rng));
  // Snapshot 0 is the background: flat.
  clip.frames[0].assign(3 * pixels, 128);
  for (size_t t = 1; t < count; ++t)
    for (size_t p = 0; p < pixels; ++p)
      if (static_cast<double>((p * 7919 + t * 101) % pixels) <
          foreground * static_cast<double>(pixels))
        clip.at(t, 0, p) = 255;
  const Window window = to_window(clip);
  QuaternionMatrixd first(static_cast<Eigen::Index>(count), 1);
  first.a(0, 0) = 1;
  BackgroundModel model;
  model.build(window, model_of(first, 1.0, Quaterniond(1.0)));
  Pool pool(1);
  return foreground_statistics(window, model, fixed_threshold, pool);
}

TEST(ForegroundStatistics, FindsTheNoiseBehindAForeground) {
  // The flat snapshot, a tenth, has no residual. So a quarter of all is the 16.7 % quantile of the
  // noise without a foreground (0.931 sigma by the chi distribution) and the 23.8 % quantile with
  // one (1.078 sigma); both are reported over 1.1012.
  const std::pair<double, double> expected[] = {{0.0, 0.931}, {0.3, 1.078}};
  for (const auto& [foreground, quantile] : expected) {
    const auto statistics = statistics_of(6, foreground, 0);
    // Two histogram bins of 1/8 level, and 1 % of sampling.
    EXPECT_NEAR(statistics.noise, 6 * quantile / 1.1012, 0.25 / 1.1012 + 0.06) << foreground;
    EXPECT_EQ(statistics.threshold, automatic_threshold(statistics.noise));
    EXPECT_NEAR(statistics.ratio, 0.9 * foreground, 0.02) << "nine snapshots of ten have it";
  }
}

TEST(ForegroundStatistics, FixedThresholdAndNoNoise) {
  const auto statistics = statistics_of(0, 0.2, 50);
  EXPECT_EQ(statistics.noise, 0);
  EXPECT_EQ(statistics.threshold, 50);
  EXPECT_NEAR(statistics.ratio, 0.18, 0.001);  // exact but for a pixel of rounding
  EXPECT_EQ(statistics_of(0, 0.2, 200).ratio, 0) << "nothing is 200 levels off";
  EXPECT_EQ(statistics_of(0, 0.2, 0).threshold, 18);
}

}  // namespace
}  // namespace qdmd::test
