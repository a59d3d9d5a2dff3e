// SPDX-License-Identifier: LGPL-2.1-or-later
// Estimators against what is known of clips that are made of exponentials and noise.
#include "core/dmd/estimator.h"

#include "core/dmd/qdmd.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

constexpr Estimator kEstimators[] = {Estimator::exact, Estimator::forward_backward,
                                     Estimator::total, Estimator::optimized};

BackgroundModes solve(const Clip& clip, DmdOptions options, Estimator estimator) {
  options.estimator = estimator;
  options.solver = Solver::gram;
  return qdmd_from_gram(quaternion_gram_of(clip), options);
}

Clip fading(double factor, double sigma, size_t pixels, size_t count, std::mt19937& rng) {
  const auto picture = random_picture(pixels, rng, 60, 200);
  std::normal_distribution<double> noise(0, 1);
  Clip clip(pixels, count);
  for (size_t t = 0; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels; ++p)
        clip.set(t, c, p,
                 picture[c * pixels + p] * std::pow(factor, static_cast<double>(t)) +
                     sigma * noise(rng));
  return clip;
}

void expect_finite(const BackgroundModes& modes) {
  EXPECT_TRUE(modes.eigenvalues.allFinite());
  EXPECT_TRUE(modes.combination.all_finite());
  EXPECT_TRUE(modes.amplitudes.all_finite());
}

// An exact model has no noise to tell estimators apart: lambda = 1/2, one mode.
TEST(Estimator, AllAgreeOnAnExactFade) {
  std::mt19937 rng(91);
  const auto base = random_picture(40, rng, 0, 15);
  Clip clip(40, 5);
  for (size_t t = 0; t < 5; ++t)
    for (size_t i = 0; i < base.size(); ++i)
      clip.frames[t][i] = static_cast<uint8_t>(base[i] << (4 - t));
  const auto x = to_quaternions(clip);
  for (Estimator estimator : kEstimators) {
    SCOPED_TRACE(static_cast<int>(estimator));
    const auto modes = solve(clip, {}, estimator);
    ASSERT_EQ(modes.eigenvalues.size(), 1);
    // Central differences find a maximum to half the digits.
    const double tolerance = estimator == Estimator::optimized ? 1e-6 : 1000 * kEpsilon;
    EXPECT_LE(std::abs(modes.eigenvalues(0) - 0.5), tolerance);
    for (int t = 0; t < 5; ++t)
      EXPECT_LE(largest_part(background_at(x, modes, t) - x.col(t)), 255 * 8 * tolerance);
  }
}

// A colour that turns has a complex eigenvalue in its class, whatever the estimator.
TEST(Estimator, TurningColoursKeepTheirAngle) {
  std::mt19937 rng(92);
  const auto start = random_picture(60, rng, 10, 240);
  Clip clip(60, 9);
  for (size_t t = 0; t < 9; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < 60; ++p) clip.at(t, (c + t) % 3, p) = start[c * 60 + p];
  DmdOptions options;
  options.rank = 2;
  options.omega_threshold = kInfinity;
  const auto x = to_quaternions(clip);
  for (Estimator estimator : kEstimators) {
    SCOPED_TRACE(static_cast<int>(estimator));
    const auto modes = solve(clip, options, estimator);
    ASSERT_EQ(modes.eigenvalues.size(), 2);
    EXPECT_NEAR(std::abs(modes.eigenvalues(0) - 1.0), 0, 1e-6);
    EXPECT_NEAR(std::arg(modes.eigenvalues(1)), 2 * M_PI / 3, 1e-6);
    for (int t = 0; t < 9; ++t)
      EXPECT_LE(largest_part(background_at(x, modes, t) - x.col(t)), 1e-3);
  }
}

// A picture, and one that alternates: lambda and -lambda have the same square.
TEST(Estimator, OppositeModesAreNotMixed) {
  std::mt19937 rng(95);
  std::normal_distribution<double> noise(0, 4);
  const auto still = random_picture(300, rng, 100, 150), other = random_picture(300, rng, 0, 80);
  Clip clip(300, 16);
  for (size_t t = 0; t < 16; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < 300; ++p)
        clip.set(t, c, p,
                 still[c * 300 + p] + (t % 2 ? -1.0 : 1.0) * other[c * 300 + p] + noise(rng));
  DmdOptions options;
  options.rank = 2;
  const auto x = to_quaternions(clip);
  for (Estimator estimator : kEstimators) {
    SCOPED_TRACE(static_cast<int>(estimator));
    const auto modes = solve(clip, options, estimator);
    ASSERT_EQ(modes.eigenvalues.size(), 1);
    EXPECT_NEAR(std::abs(modes.eigenvalues(0) - 1.0), 0, 0.01);
    const auto background = background_at(x, modes, 8);
    double error = 0;
    for (Eigen::Index p = 0; p < 300; ++p) {
      const Quaterniond truth(0, still[static_cast<size_t>(p)], still[static_cast<size_t>(300 + p)],
                              still[static_cast<size_t>(600 + p)]);
      error += (background.get(p, 0) - truth).squared_norm() / (3 * 300);
    }
    // Noise that the mean leaves, and no picture of the other mode, whose levels are 40 on average.
    EXPECT_LT(std::sqrt(error), 4);
  }
}

// Noise that is kept beside the background has eigenvalues of modulus 1 here, and is no background.
TEST(Estimator, ForwardBackwardTakesNoNoiseForTheBackground) {
  int roots = 0, windows = 0;
  for (int seed = 0; seed < 6; ++seed)
    for (const int rank : {2, 3, 5}) {
      SCOPED_TRACE(std::to_string(seed) + ", rank " + std::to_string(rank));
      std::mt19937 rng(static_cast<unsigned>(97 + seed));
      const auto picture = random_picture(600, rng, 60, 200);
      std::normal_distribution<double> noise(0, 1);
      Clip clip(600, 40);
      const auto truth = [&](size_t t, size_t p) {
        return picture[p] * std::pow(0.98, static_cast<double>(t));
      };
      for (size_t t = 0; t < 40; ++t)
        for (size_t p = 0; p < 600; ++p) {
          const double grey = truth(t, p) + noise(rng);
          for (size_t c = 0; c < 3; ++c) clip.set(t, c, p, grey);
        }
      DmdOptions options;
      options.rank = rank;
      const auto modes = solve(clip, options, Estimator::forward_backward);
      ASSERT_EQ(modes.eigenvalues.size(), 1);
      EXPECT_LE(std::abs(modes.eigenvalues(0) - 0.98), 0.002);
      const auto background = background_at(to_quaternions(clip), modes, 20);
      double error = 0;
      for (Eigen::Index p = 0; p < 600; ++p)
        error += std::abs(background.get(p, 0).x - truth(20, static_cast<size_t>(p))) / 600;
      EXPECT_LT(error, 1);
      ++windows;
      // Where the root does not come, the summary says whose result it is.
      if (modes.summary.estimator == Estimator::forward_backward) {
        ++roots;
      } else {
        const auto exact = solve(clip, options, Estimator::exact);
        EXPECT_EQ(modes.eigenvalues(0), exact.eigenvalues(0));
        EXPECT_EQ(modes.summary.estimator, Estimator::exact);
      }
    }
  // Both cases are looked at.
  EXPECT_GT(roots, 0);
  EXPECT_LT(roots, windows);
}

TEST(Estimator, SummaryNamesTheOneThatGaveTheResult) {
  std::mt19937 rng(98);
  const Clip clip = fading(0.99, 2, 200, 8, rng);
  DmdOptions options;
  options.rank = 1;
  for (Estimator estimator : kEstimators)
    EXPECT_EQ(solve(clip, options, estimator).summary.estimator, estimator);
}

// Nothing is left out there that they could make use of.
TEST(Estimator, TwoAreThePapersAtFullRank) {
  std::mt19937 rng(96);
  const Clip clip = fading(0.99, 5, 200, 8, rng);
  DmdOptions options;
  options.rank = 7;
  const auto exact = solve(clip, options, Estimator::exact);
  for (Estimator estimator : {Estimator::forward_backward, Estimator::total}) {
    SCOPED_TRACE(static_cast<int>(estimator));
    const auto modes = solve(clip, options, estimator);
    EXPECT_LE(std::abs(modes.eigenvalues(0) - exact.eigenvalues(0)), 1e-8);
    options.rank = 0;
    const auto chosen = solve(clip, options, estimator);
    options.rank = 1;
    EXPECT_EQ(chosen.eigenvalues(0), solve(clip, options, estimator).eigenvalues(0));
    EXPECT_EQ(chosen.summary.rank, 1);
    options.rank = 7;
  }
}

// The noise that shrinks |lambda| of the paper's estimate: seeds' mean and its standard error.
TEST(Estimator, NoiseBendsTheOthersLess) {
  constexpr int kSeeds = 12;
  for (double factor : {1.0, 0.995}) {
    double bias[4] = {};
    for (int seed = 0; seed < kSeeds; ++seed) {
      std::mt19937 rng(static_cast<unsigned>(1000 + seed));
      const Clip clip = fading(factor, 8, 400, 12, rng);
      for (Estimator estimator : kEstimators)
        bias[static_cast<int>(estimator)] +=
            (std::abs(solve(clip, {}, estimator).eigenvalues(0)) - factor) / kSeeds;
    }
    // sigma^2 / A^2 over the frames: what is expected of the paper's, seen from below.
    EXPECT_LT(bias[0], 0) << factor;
    for (int k : {1, 2, 3}) EXPECT_LT(std::abs(bias[k]), std::abs(bias[0])) << k;
  }
}

// Whatever the frames: few levels make ties, zero columns and repeated eigenvalues.
TEST(Estimator, NothingIsNaNInTinyWindowsOfFewLevels) {
  std::mt19937 rng(94);
  const std::vector<std::vector<int>> alphabets = {{0, 255}, {0, 1}, {0, 0, 0, 200}, {7, 8}};
  for (int repeat = 0; repeat < 300; ++repeat) {
    const size_t pixels = 1 + rng() % 5, count = 1 + rng() % 8;
    const auto& alphabet = alphabets[rng() % alphabets.size()];
    Clip clip(pixels, count);
    for (auto& frame : clip.frames)
      for (auto& sample : frame) sample = static_cast<uint8_t>(alphabet[rng() % alphabet.size()]);
    const double threshold = repeat % 3 == 0 ? 0 : repeat % 3 == 1 ? 1.0 : kInfinity;
    for (auto amplitude : {Amplitude::window, Amplitude::first_frame})
      for (Estimator estimator : kEstimators) {
        SCOPED_TRACE(std::to_string(repeat) + ", " + std::to_string(static_cast<int>(estimator)));
        expect_finite(solve(clip, options_of(amplitude, repeat % 4, threshold), estimator));
      }
    if (HasFailure()) break;
  }
}

}  // namespace
}  // namespace qdmd::test
