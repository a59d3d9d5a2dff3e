// SPDX-License-Identifier: LGPL-2.1-or-later
// Sensor noise and jitter against their models.
#include <algorithm>
#include <complex>
#include <limits>
#include <numbers>

#include "core/scene/effects/sensor_noise.h"
#include "core/scene/paint.h"
#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

// ---- Noise ----

struct Moments {
  double n = 0, sum = 0, squares = 0;

  void add(double value) { ++n, sum += value, squares += value * value; }
  double mean() const { return sum / n; }
  double variance() const { return squares / n - mean() * mean(); }
};

void expect_variance(const Moments& moments, double expected, const std::string& what) {
  // 4.5 sigma of the mean and of the variance of normal numbers.
  EXPECT_NEAR(moments.mean(), 0, 4.5 * std::sqrt(expected / moments.n)) << what;
  EXPECT_NEAR(moments.variance(), expected, 4.5 * expected * std::sqrt(2 / moments.n)) << what;
}

TEST(SensorNoise, EveryLevelHasTheVarianceOfTheModel) {
  constexpr int kSide = 250;
  for (const scene::NoiseModel& model :
       {scene::NoiseModel{1, 0, 1}, {0.5, 0.02, 4}, {2, 0.01, 2}, {0, 0.05, 3}})
    for (const int level : {60, 100, 128, 170, 200}) {
      const scene::SensorNoise noise(model);
      scene::Picture picture(kSide, kSide);
      picture.fill(static_cast<uint8_t>(level));
      auto stream = scene::StreamSource(17, "test").at(level);
      noise.add(stream, &picture);
      Moments moments;
      for (const uint8_t sample : picture.samples) moments.add(sample - level);
      // Rounding adds 1/12: at a deviation of 1 that is right to exp(-2 pi^2).
      const double expected = model.read * model.read * model.gain * model.gain +
                              model.shot * model.gain * level + 1 / 12.0;
      expect_variance(moments, expected, "level " + std::to_string(level));
    }
}

TEST(SensorNoise, ClipsAtBlackAndWhite) {
  const scene::SensorNoise noise({40, 0, 1});
  for (const int level : {0, 255}) {
    scene::Picture picture(100, 101);
    picture.fill(static_cast<uint8_t>(level));
    auto stream = scene::StreamSource(2, "test").at(0);
    noise.add(stream, &picture);
    const auto stays = static_cast<double>(
        std::count(picture.samples.begin(), picture.samples.end(), static_cast<uint8_t>(level)));
    // Half of it is clipped, and what is less than half a level: 4.5 sigma.
    const auto n = static_cast<double>(picture.samples.size());
    const double share = 0.5 + 0.5 * std::erf(0.5 / 40 / std::numbers::sqrt2);
    EXPECT_NEAR(stays, n * share, 4.5 * std::sqrt(n / 4));
  }
}

// The noise of a scene at samples of one level of the true background, where nobody is.
std::array<Moments, 256> noise_by_level(const std::string& text, int frames) {
  Scene scene(options(96, 72), text);
  std::array<Moments, 256> moments;
  for (int64_t k = 0; k < frames; ++k) {
    const Shot shot = shoot(&scene, k);
    for (size_t i = 0; i < shot.frame.size(); ++i)
      if (shot.labels[i / 3] == 0)
        moments[shot.background[i]].add(static_cast<double>(shot.frame[i]) - shot.background[i]);
  }
  return moments;
}

TEST(SceneNoise, VarianceByLevelAndGain) {
  struct Case {
    std::string text;
    double read, shot;  // variances: constant, and per level
  };
  const double gain6 = std::pow(10, 6 / 20.0), gain20 = 10, night = std::pow(10, 18 / 20.0);
  const Case cases[] = {
      {"noise", 2, 2 / 128.0},
      {"noise=3:shot=1", 0, 9 / 128.0},
      {"noise=3:shot=0", 9, 0},
      {"noise=2:gain=6", 2 * gain6 * gain6, 2 / 128.0 * gain6},
      {"noise=1:shot=0.3:gain=20", 0.7 * gain20 * gain20, 0.3 / 128 * gain20},
      {"night=0.06", night * night, 0.02 * night},
  };
  for (const Case& test : cases) {
    const auto levels = noise_by_level(test.text, 30);
    int tested = 0;
    for (int level = 0; level < 256; ++level) {
      const Moments& moments = levels[static_cast<size_t>(level)];
      const double expected = test.read + test.shot * level + 1 / 12.0;
      // Enough of them, and five sigma away from the ends.
      if (moments.n < 2000 || level < 5 * std::sqrt(expected) ||
          level > 255 - 5 * std::sqrt(expected) || expected < 1)
        continue;
      ++tested;
      expect_variance(moments, expected, test.text + " level " + std::to_string(level));
    }
    EXPECT_GT(tested, 40) << test.text;
  }
}

TEST(SceneNoise, SamplesAreIndependent) {
  constexpr int kWidth = 96, kHeight = 72;
  Scene scene(options(kWidth, kHeight), "noise=4:shot=0");
  std::vector<double> last;
  double products[4] = {}, n[4] = {};
  for (int64_t k = 0; k < 60; ++k) {
    const Shot shot = shoot(&scene, k);
    std::vector<double> noise(shot.frame.size());
    for (size_t i = 0; i < noise.size(); ++i)
      noise[i] =
          shot.labels[i / 3] ? 0 : (static_cast<double>(shot.frame[i]) - shot.background[i]) / 4;
    const auto add = [&](int kind, double a, double b) { products[kind] += a * b, ++n[kind]; };
    for (size_t i = 0; i < noise.size(); ++i) {
      if (i % 3 != 2) add(0, noise[i], noise[i + 1]);
      if (i + 3 < noise.size()) add(1, noise[i], noise[i + 3]);
      if (i + 3 * kWidth < noise.size()) add(2, noise[i], noise[i + 3 * kWidth]);
      if (!last.empty()) add(3, noise[i], last[i]);
    }
    last = noise;
  }
  // Channels, pixels beside and below each other, frames: 4.5 sigma, with the variance of rounding.
  for (int kind = 0; kind < 4; ++kind)
    EXPECT_NEAR(products[kind] / n[kind], 0, 4.5 * (1 + 1 / 192.0) / std::sqrt(n[kind])) << kind;
}

// ---- Jitter ----

constexpr double kTwoPi = 2 * std::numbers::pi;

std::array<std::vector<double>, 2> shifts(const std::string& text, double rate, int frames,
                                          uint64_t seed) {
  Scene scene(options(1, 1, rate, seed), text);
  std::array<std::vector<double>, 2> series;
  for (int64_t k = 0; k < frames; ++k) {
    scene.render(k, scene::kBoxes);
    series[0].push_back(scene.shift_x());
    series[1].push_back(scene.shift_y());
  }
  return series;
}

TEST(SceneJitter, HasItsDeviationInBothDirections) {
  constexpr int kFrames = 100000;
  for (const double deviation : {0.5, 1.5, 6.0})
    for (uint64_t seed = 1; seed <= 2; ++seed) {
      const auto series = shifts("jitter=" + std::to_string(deviation), 100, kFrames, seed);
      double both = 0;
      for (size_t i = 0; i < kFrames; ++i) both += series[0][i] * series[1][i] / kFrames;
      // A spectrum 1 / (f^2 + f0^2) has the correlation exp(-2 pi f0 |t|), whose square integrates
      // to 1 / (2 pi f0): over T the variance of an estimated variance is 2 / (2 pi f0 T) of its
      // square. 4.5 sigma; T = 1000 s, f0 = 3 Hz / tan(atan(8) / 2).
      const double f0 = 3 / std::tan(std::atan(8.0) / 2);
      const double sigma = std::sqrt(2 / (kTwoPi * f0 * kFrames / 100.0));
      const double square = deviation * deviation;
      for (const auto& axis : series) {
        Moments moments;
        for (const double shift : axis) moments.add(shift);
        EXPECT_NEAR(moments.variance(), square, 4.5 * square * sigma) << deviation;
      }
      EXPECT_NEAR(both, 0, 4.5 * square * sigma) << deviation;
    }
}

// In place, of a power of two.
void fourier(std::vector<std::complex<double>>* values) {
  auto& v = *values;
  for (size_t i = 1, j = 0; i < v.size(); ++i) {
    size_t bit = v.size() >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(v[i], v[j]);
  }
  for (size_t length = 2; length <= v.size(); length *= 2)
    for (size_t start = 0; start < v.size(); start += length)
      for (size_t k = 0; k < length / 2; ++k) {
        const auto turn =
            std::polar(1.0, -kTwoPi * static_cast<double>(k) / static_cast<double>(length));
        const auto a = v[start + k], b = v[start + k + length / 2] * turn;
        v[start + k] = a + b;
        v[start + k + length / 2] = a - b;
      }
}

TEST(SceneJitter, HalfOfThePowerLiesBelowItsFrequency) {
  constexpr int kFrames = 1 << 16;
  constexpr double kRate = 100;
  for (const double frequency : {1.0, 3.0, 5.0}) {
    double below = 0, total = 0, quarter = 0, beyond = 0;
    for (uint64_t seed = 1; seed <= 2; ++seed)
      for (const auto& axis :
           shifts("jitter=1:frequency=" + std::to_string(frequency), kRate, kFrames, seed)) {
        std::vector<std::complex<double>> spectrum(kFrames);
        for (size_t i = 0; i < kFrames; ++i)
          spectrum[i] = axis[i] * (1 - std::cos(kTwoPi * static_cast<double>(i) / kFrames));
        fourier(&spectrum);
        const double f0 = frequency / std::tan(std::atan(8.0) / 2);
        for (size_t i = 0; i < kFrames / 2; ++i) {
          const double f = static_cast<double>(i) * kRate / kFrames, power = std::norm(spectrum[i]);
          total += power;
          if (f < frequency) below += power;
          if (f < f0 * std::tan(std::atan(8.0) / 4)) quarter += power;
          // Cut off at 8 f0; the window's main lobe reaches two lines farther.
          if (f > 8 * f0 + 3 * kRate / kFrames) beyond += power;
        }
      }
    // Twelve of 24 waves of equal power; what leaks between them at 0.0015 Hz is 1 % at most: the
    // window's side lobes are below -31 dB, and fall by 18 dB an octave.
    EXPECT_NEAR(below / total, 0.5, 0.01) << frequency;
    EXPECT_NEAR(quarter / total, 0.25, 0.01) << frequency;
    EXPECT_LT(beyond / total, 0.01) << frequency;
  }
}

TEST(SceneJitter, ThePictureIsShiftedByTheShift) {
  constexpr int kWidth = 160, kHeight = 120, kBorder = 30;
  Scene shaken(options(kWidth, kHeight), "jitter=3"), still(options(kWidth, kHeight), "default");
  double farthest = 0;
  for (int64_t k = 0; k < 60; k += 3) {
    const Shot shot = shoot(&shaken, k), plain = shoot(&still, k);
    farthest = std::max({farthest, std::abs(shot.shift_x), std::abs(shot.shift_y)});
    const int dx = static_cast<int>(std::floor(shot.shift_x)),
              dy = static_cast<int>(std::floor(shot.shift_y));
    const double u = shot.shift_x - dx, v = shot.shift_y - dy;
    ASSERT_LT(std::max(std::abs(dx), std::abs(dy)), kBorder - 1);
    for (const auto& [moved, from] :
         {std::pair(&shot.frame, &plain.frame), std::pair(&shot.background, &plain.background)}) {
      double worst = 0, sum = 0;
      int samples = 0;
      for (int y = kBorder; y < kHeight - kBorder; ++y)
        for (int x = kBorder; x < kWidth - kBorder; ++x)
          for (int c = 0; c < 3; ++c) {
            const auto at = [&, source = from](int ox, int oy) {
              return static_cast<double>(
                  (*source)[static_cast<size_t>(((y + dy + oy) * kWidth + x + dx + ox) * 3 + c)]);
            };
            const double a = at(0, 0), b = at(1, 0), d = at(0, 1), e = at(1, 1);
            const double expected = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * e);
            // Half a level of rounding, and the slopes times 1/512 pixel.
            const double slopes = std::max(std::abs(b - a), std::abs(e - d)) +
                                  std::max(std::abs(d - a), std::abs(e - b));
            const double error =
                std::abs((*moved)[static_cast<size_t>((y * kWidth + x) * 3 + c)] - expected);
            worst = std::max(worst, error - slopes / 512);
            sum += error, ++samples;
          }
      EXPECT_LE(worst, 0.5 + 1e-9) << k;
      // Rounding alone is off by a quarter on average.
      EXPECT_LT(sum / samples, 0.35) << k;
    }
  }
  EXPECT_GT(farthest, 3);
}

// Between pixels of a plane that rises evenly, levels lie on that plane.
TEST(CropTurned, InterpolatesBetweenPixels) {
  constexpr int kCanvas = 60, kFrame = 31;
  const double slope[3][2] = {{2, 1}, {-1.5, 2.25}, {0.25, -3}};
  const double start[3] = {20, 100, 210};
  const auto level = [&](int c, double x, double y) {
    return start[c] + slope[c][0] * x + slope[c][1] * y;
  };
  scene::Picture canvas(kCanvas, kCanvas);
  for (int y = 0; y < kCanvas; ++y)
    for (int x = 0; x < kCanvas; ++x)
      for (int c = 0; c < 3; ++c)
        canvas.at(x, y)[c] = static_cast<uint8_t>(std::lround(level(c, x, y)));
  scene::Picture frame(kFrame, kFrame);
  for (double turn : {0.0, 0.003, -0.02, 0.4})
    for (const auto& [left, top] : {std::pair{12.0, 14.0}, {12.25, 14.5}, {13.7, 12.9}}) {
      crop_turned(canvas, left, top, turn, &frame);
      constexpr double kMiddle = (kFrame - 1) / 2.0;
      for (int y = 0; y < kFrame; ++y)
        for (int x = 0; x < kFrame; ++x) {
          const double u = x - kMiddle, v = y - kMiddle;
          const double at_x = left + kMiddle + std::cos(turn) * u - std::sin(turn) * v,
                       at_y = top + kMiddle + std::sin(turn) * u + std::cos(turn) * v;
          // Two roundings of half a level, and of places to 1/256 pixel.
          for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(frame.at(x, y)[c], level(c, at_x, at_y), 1.05)
                << c << " at " << x << " " << y << ", turn " << turn;
        }
    }
}

}  // namespace
}  // namespace qdmd::test
