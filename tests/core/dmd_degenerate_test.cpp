// SPDX-License-Identifier: LGPL-2.1-or-later
// Windows that hardly have a decomposition.
#include "core/dmd/channel_dmd.h"
#include "core/dmd/qdmd.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// A few sums and products of levels of 255, in windows whose condition is about 1.
constexpr double kLevelTolerance = 1000 * kEpsilon * 255;

struct Solved {
  std::string name;
  DmdOptions options;
  BackgroundModes modes;
};

// Both solvers, both amplitudes.
std::vector<Solved> solve_every_way(const Clip& clip, int rank = 0, double threshold = 0) {
  std::vector<Solved> all;
  for (auto amplitude : {Amplitude::window, Amplitude::first_frame}) {
    const auto options = options_of(amplitude, rank, threshold);
    all.push_back(
        {"gram, " + describe(options), options, qdmd_from_gram(quaternion_gram_of(clip), options)});
    all.push_back({"adjoint, " + describe(options), options,
                   qdmd_from_adjoint(to_quaternions(clip), options)});
  }
  return all;
}

void expect_finite_summary(const DmdSummary& summary) {
  EXPECT_TRUE(std::isfinite(std::abs(summary.lambda)));
  EXPECT_FALSE(std::isnan(summary.omega));
  EXPECT_TRUE(std::isfinite(summary.residual));
  EXPECT_TRUE(std::isfinite(summary.condition));
  EXPECT_GE(summary.condition, 1);
}

void expect_finite(const BackgroundModes& modes) {
  EXPECT_TRUE(modes.eigenvalues.allFinite());
  EXPECT_TRUE(modes.combination.all_finite());
  EXPECT_TRUE(modes.amplitudes.all_finite());
  EXPECT_TRUE(modes.reference_times.allFinite());
  expect_finite_summary(modes.summary);
}

void expect_no_mode(const BackgroundModes& modes, Eigen::Index snapshots) {
  EXPECT_EQ(modes.eigenvalues.size(), 0);
  EXPECT_EQ(modes.combination.rows(), snapshots);
  EXPECT_EQ(modes.combination.cols(), 0);
  EXPECT_EQ(modes.amplitudes.rows(), 0);
  EXPECT_EQ(modes.summary.rank, 0);
  EXPECT_EQ(modes.summary.background_modes, 0);
  expect_finite_summary(modes.summary);
}

void expect_background(const Solved& solved, const Clip& clip, int t,
                       const QuaternionMatrixd& expected) {
  EXPECT_LE(largest_part(background_at(to_quaternions(clip), solved.modes, t) - expected),
            kLevelTolerance)
      << "t " << t;
}

TEST(Degenerate, NoOrOneSnapshotHasNoMode) {
  std::mt19937 rng(81);
  for (size_t count : {0u, 1u}) {
    const Clip clip = random_clip(5, count, rng);
    const auto m = static_cast<Eigen::Index>(count);
    const auto x = to_quaternions(clip);
    expect_no_mode(qdmd_from_gram(x.conjugate_transpose() * x, {}), m);
    expect_no_mode(qdmd_from_adjoint(x, {}), m);
    const auto channel = channel_dmd(Eigen::MatrixXd::Ones(m, m), {});
    EXPECT_EQ(channel.eigenvalues.size(), 0);
    EXPECT_EQ(channel.combination.rows(), m);
    EXPECT_EQ(channel.summary.background_modes, 0);
  }
  expect_no_mode(qdmd_from_adjoint(QuaternionMatrixd(0, 5), {}), 5);
}

TEST(Degenerate, ZeroWindowHasNoMode) {
  for (size_t count : {2u, 3u, 9u}) {
    const Clip black(7, count);
    for (const auto& solved : solve_every_way(black)) {
      SCOPED_TRACE(solved.name);
      expect_no_mode(solved.modes, static_cast<Eigen::Index>(count));
      const auto channel = channel_dmd(channel_gram(gram_of(to_window(black)), 0), solved.options);
      EXPECT_EQ(channel.eigenvalues.size(), 0);
      EXPECT_EQ(channel.summary.rank, 0);
    }
  }
}

TEST(Degenerate, TwoSnapshotsHaveOneMode) {
  std::mt19937 rng(82);
  const Clip clip = random_clip(30, 2, rng);
  const auto x = to_quaternions(clip);
  // Q~ is the quaternion x_1^H x_2 / |x_1|^2; its class is the eigenvalue.
  const auto g = x.conjugate_transpose() * x;
  const auto q = g.get(0, 1) * (1 / g.get(0, 0).w);
  for (const auto& solved : solve_every_way(clip)) {
    SCOPED_TRACE(solved.name);
    expect_finite(solved.modes);
    ASSERT_EQ(solved.modes.eigenvalues.size(), 1);
    // A few roundings of numbers near 1.
    EXPECT_LE(std::abs(solved.modes.eigenvalues(0) - std::complex(q.w, q.vector_norm())),
              64 * kEpsilon);
  }
}

TEST(Degenerate, StaticWindowIsItsOwnBackground) {
  std::mt19937 rng(83);
  for (size_t pixels : {1u, 3u, 50u})
    for (size_t count : {2u, 3u, 12u}) {
      const auto picture = random_picture(pixels, rng, 1, 255);
      const Clip clip = static_clip(picture, count);
      const auto x = to_quaternions(clip);
      for (double threshold : {0.0, 0.5, kInfinity})
        for (const auto& solved : solve_every_way(clip, 0, threshold)) {
          SCOPED_TRACE(solved.name);
          expect_finite(solved.modes);
          EXPECT_EQ(solved.modes.summary.rank, 1);
          // count sums of exact integers, then one division.
          EXPECT_LE(std::abs(solved.modes.summary.lambda - 1.0),
                    16 * static_cast<double>(count) * kEpsilon);
          for (int t = 0; t < x.cols(); ++t) expect_background(solved, clip, t, x.col(0));
        }
    }
}

TEST(Degenerate, OnePixelAndFewerPixelsThanSnapshots) {
  std::mt19937 rng(84);
  for (size_t pixels : {1u, 2u, 4u}) {
    const Clip clip = random_clip(pixels, 12, rng);
    const auto x = to_quaternions(clip);
    const auto solved = solve_every_way(clip);
    for (const auto& s : solved) {
      SCOPED_TRACE(s.name);
      expect_finite(s.modes);
      EXPECT_EQ(s.modes.summary.rank, static_cast<int>(pixels));
    }
    // The solvers agree although the Gram matrix is singular.
    for (size_t i = 0; i < solved.size(); i += 2)
      for (int t = 0; t < 12; ++t)
        EXPECT_LE(largest_part(background_at(x, solved[i].modes, t) -
                               background_at(x, solved[i + 1].modes, t)),
                  picture_tolerance(solved[i].modes.summary.condition));
  }
}

TEST(Degenerate, RepeatedFrames) {
  std::mt19937 rng(85);
  const auto a = random_picture(40, rng), b = random_picture(40, rng);
  Clip clip(40, 0);
  clip.frames = {a, a, b, b, b, a, a, b};
  const auto x = to_quaternions(clip);
  const auto solved = solve_every_way(clip);
  for (const auto& s : solved) {
    SCOPED_TRACE(s.name);
    expect_finite(s.modes);
    EXPECT_EQ(s.modes.summary.rank, 2);
  }
  for (size_t i = 0; i < solved.size(); i += 2)
    for (int t = 0; t < 8; ++t)
      EXPECT_LE(largest_part(background_at(x, solved[i].modes, t) -
                             background_at(x, solved[i + 1].modes, t)),
                picture_tolerance(solved[i].modes.summary.condition));
}

TEST(Degenerate, BlackFirstFrame) {
  std::mt19937 rng(86);
  const auto picture = random_picture(30, rng);
  const size_t count = 10;
  Clip clip = static_clip(picture, count);
  clip.frames[0].assign(clip.frames[0].size(), 0);
  const auto x = to_quaternions(clip);
  // lambda is 1: all later frames agree. The fit to all frames sees nine pictures and one zero;
  // the paper's amplitude sees the zero alone.
  auto expected = x.col(1);
  expected.a *= static_cast<double>(count - 1) / count;
  for (const auto& solved : solve_every_way(clip)) {
    SCOPED_TRACE(solved.name);
    expect_finite(solved.modes);
    const bool window = solved.options.amplitude == Amplitude::window;
    if (window) expected.b = x.col(1).b * (static_cast<double>(count - 1) / count);
    for (int t : {0, 5, 9})
      expect_background(solved, clip, t, window ? expected : QuaternionMatrixd(30, 1));
  }
}

TEST(Degenerate, AlternatingFrames) {
  std::mt19937 rng(87);
  const auto a = random_picture(30, rng), b = random_picture(30, rng);
  Clip clip(30, 0);
  for (int t = 0; t < 5; ++t) clip.frames.insert(clip.frames.end(), {a, b});
  const auto x = to_quaternions(clip);
  // x_t = (A + B) / 2 + (-1)^t (A - B) / 2, an exact model: 1 and -1.
  auto mean = x.col(0) + x.col(1);
  mean.a *= 0.5;
  mean.b *= 0.5;
  for (const auto& solved : solve_every_way(clip)) {
    SCOPED_TRACE(solved.name);
    for (int t = 0; t < 10; ++t) expect_background(solved, clip, t, mean);
  }
  for (const auto& solved : solve_every_way(clip, 0, kInfinity)) {
    SCOPED_TRACE(solved.name);
    ASSERT_EQ(solved.modes.eigenvalues.size(), 2);
    EXPECT_LE(std::abs(solved.modes.eigenvalues(0) - 1.0), 1000 * kEpsilon);
    EXPECT_LE(std::abs(solved.modes.eigenvalues(1) + 1.0), 1000 * kEpsilon);
    for (int t = 0; t < 10; ++t) expect_background(solved, clip, t, x.col(t));
  }
}

TEST(Degenerate, ExponentialFadeAndGrowth) {
  std::mt19937 rng(88);
  const auto base = random_picture(25, rng, 0, 15);
  const size_t count = 5;
  for (bool grows : {false, true}) {
    Clip clip(25, count);
    for (size_t t = 0; t < count; ++t)
      for (size_t i = 0; i < base.size(); ++i)
        clip.frames[t][i] = static_cast<uint8_t>(base[i] << (grows ? t : count - 1 - t));
    const auto x = to_quaternions(clip);
    for (const auto& solved : solve_every_way(clip)) {
      SCOPED_TRACE(solved.name);
      ASSERT_EQ(solved.modes.eigenvalues.size(), 1);
      EXPECT_LE(std::abs(solved.modes.eigenvalues(0) - (grows ? 2.0 : 0.5)), 64 * kEpsilon);
      EXPECT_NEAR(solved.modes.summary.omega, std::log(2.0), 64 * kEpsilon);
      // Documented: growing modes count from the last snapshot, fitted ones only.
      const bool window = solved.options.amplitude == Amplitude::window;
      EXPECT_EQ(solved.modes.reference_times(0), grows && window ? 4 : 0);
      for (int t = 0; t < x.cols(); ++t) expect_background(solved, clip, t, x.col(t));
    }
  }
}

TEST(Degenerate, NothingIsNaNInTinyWindowsOfFewLevels) {
  // Small alphabets make ties, zero columns, repeated and zero eigenvalues by the dozen.
  std::mt19937 rng(89);
  const std::vector<std::vector<int>> alphabets = {{0, 255}, {0, 1}, {0, 0, 0, 200}, {7, 8}};
  for (int repeat = 0; repeat < 600; ++repeat) {
    const size_t pixels = 1 + rng() % 5, count = 2 + rng() % 7;
    const auto& alphabet = alphabets[rng() % alphabets.size()];
    Clip clip(pixels, count);
    for (auto& frame : clip.frames)
      for (auto& sample : frame) sample = static_cast<uint8_t>(alphabet[rng() % alphabet.size()]);
    const double threshold = repeat % 3 == 0 ? 0 : repeat % 3 == 1 ? 1.0 : kInfinity;
    const auto x = to_quaternions(clip);
    const auto gram = gram_of(to_window(clip));
    for (const auto& solved : solve_every_way(clip, repeat % 4, threshold)) {
      SCOPED_TRACE(solved.name + ", repeat " + std::to_string(repeat));
      expect_finite(solved.modes);
      double residual = 0;
      for (int t = 0; t < x.cols(); ++t)
        residual += (background_at(x, solved.modes, t) - x.col(t)).squared_norm();
      // b = 0 is one of the amplitudes that a fit may choose. Dependent modes of nearly singular
      // normal equations cost half the digits.
      if (solved.options.amplitude == Amplitude::window) {
        EXPECT_LE(residual, x.squared_norm() * (1 + std::sqrt(kEpsilon)));
      }
      for (int c = 0; c < kChannels; ++c) {
        const auto modes = channel_dmd(channel_gram(gram, c), solved.options);
        EXPECT_TRUE(modes.eigenvalues.allFinite() && modes.combination.allFinite() &&
                    modes.amplitudes.allFinite());
        expect_finite_summary(modes.summary);
      }
    }
    if (HasFailure()) break;
  }
}

}  // namespace
}  // namespace qdmd::test
