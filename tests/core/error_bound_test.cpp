// SPDX-License-Identifier: LGPL-2.1-or-later
// How sure a solve says it is, against what happens to it.
#include "core/dmd/error_bound.h"

#include "core/dmd/estimator.h"
#include "core/dmd/first_order.h"
#include "core/dmd/qdmd.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

struct Solve {
  QuaternionMatrixd gram;
  SnapshotFactor<double> factor;
  DmdOptions options;
  BackgroundModes modes;
  double pixels;

  Solve(const Clip& clip, int rank, Estimator estimator, bool extended = false)
      : gram(quaternion_gram_of(clip)),
        factor(extended ? factorize_gram_extended(gram) : factorize_gram(gram)),
        pixels(static_cast<double>(clip.pixels)) {
    options.rank = rank;
    options.estimator = estimator;
    modes = solve_factor(factor, options);
  }
  SolvedWindow window() const { return {gram, pixels, options, factor, modes}; }
};

struct Case {
  int rank;
  Estimator estimator;
};
constexpr Case kCases[] = {{0, Estimator::exact},
                           {1, Estimator::exact},
                           {1, Estimator::forward_backward},
                           {1, Estimator::total}};

// Derivatives tell all of a camera's window, and the bound holds without being useless.
TEST(RoundingBound, OfACameraHoldsAndIsSmall) {
  for (int m : {8, 30, 60})
    for (const Case& c : kCases) {
      SCOPED_TRACE(std::to_string(m) + ", rank " + std::to_string(c.rank) + ", estimator " +
                   std::to_string(static_cast<int>(c.estimator)));
      std::mt19937 rng(static_cast<unsigned>(300 + m));
      const Clip clip = noisy_clip(600, static_cast<size_t>(m), 3, rng);
      const Solve fast(clip, c.rank, c.estimator), careful(clip, c.rank, c.estimator, true);
      Push push;
      push.products = 1;
      EXPECT_TRUE(first_order_move(fast.factor, fast.options, fast.modes, push, 1));
      const double bound = rounding_bound(fast.window());
      const double error =
          background_distance(careful.factor.r, fast.pixels, fast.modes, careful.modes).largest;
      EXPECT_LE(error, bound + rounding_bound(careful.window()));
      EXPECT_LT(bound, 1e-4);
    }
}

// Levels that move at random by up to a half, many times.
TEST(Sensitivity, IsHowFarRandomLevelsMoveTheBackground) {
  constexpr int kTimes = 12;
  for (const Case& c : kCases) {
    SCOPED_TRACE("rank " + std::to_string(c.rank) + ", estimator " +
                 std::to_string(static_cast<int>(c.estimator)));
    std::mt19937 rng(310);
    std::uniform_real_distribution<double> half(-0.5, 0.5);
    const Clip clip = noisy_clip(400, 10, 4, rng);
    const Solve solve(clip, c.rank, c.estimator);
    const auto x = to_quaternions(clip);
    double squares = 0;
    for (int i = 0; i < kTimes; ++i) {
      auto moved = x;
      for (Eigen::Index t = 0; t < x.cols(); ++t)
        for (Eigen::Index p = 0; p < x.rows(); ++p)
          moved.set(p, t, moved.get(p, t) + Quaterniond(0, half(rng), half(rng), half(rng)));
      const auto gram = moved.conjugate_transpose() * moved;
      const auto modes = solve_factor(factorize_gram(gram), solve.options);
      double largest = 0;
      for (int t : {0, 5, 9})
        largest = std::max(
            largest, (background_at(moved, modes, t) - background_at(x, solve.modes, t)).norm());
      squares += largest * largest / (3 * 400 * kTimes);
    }
    const double told = sensitivity(solve.window());
    EXPECT_LT(told, 3 * std::sqrt(squares));
    EXPECT_GT(told, std::sqrt(squares) / 3);
  }
}

}  // namespace
}  // namespace qdmd::test
