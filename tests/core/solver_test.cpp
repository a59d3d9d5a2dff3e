// SPDX-License-Identifier: LGPL-2.1-or-later
// Every solver against the paper's procedure, on windows that have a decomposition.
#include "core/dmd/decompose.h"
#include "core/dmd/qdmd.h"
#include "core/quaternion/schur.h"
#include "tests/core/solver_names.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

constexpr Solver kSolvers[] = {Solver::gram, Solver::gram_extended, Solver::qr, Solver::adjoint};

BackgroundModes solve(const Clip& clip, Solver solver, DmdOptions options) {
  options.solver = solver;
  switch (solver) {
    case Solver::qr:
      return qdmd_from_qr(to_window(clip), options);
    case Solver::adjoint:
      return qdmd_from_adjoint(to_quaternions(clip), options);
    default:
      return qdmd_from_gram(quaternion_gram_of(clip), options);
  }
}

// m 3 .. 25 and n 30 .. 400, mostly odd sizes: blocks and vector widths end in the middle.
Clip random_window(unsigned seed) {
  std::mt19937 rng(1000 + seed);
  const size_t count = 3 + rng() % 23, pixels = 30 + rng() % 371;
  switch (seed % 3) {
    case 0:
      return noisy_clip(pixels, count, 2 + static_cast<double>(seed), rng);
    case 1:
      return moving_box_clip(pixels, count, pixels / 5, rng);
    default:
      return colour_rotating_clip(pixels, count, 0.2 + 0.1 * static_cast<double>(seed), 4, rng);
  }
}

// Over the window: |L - L'| in any part of any pixel. Infinite powers would be NaN, which wins.
double background_distance(const QuaternionMatrixd& x, const BackgroundModes& l,
                           const BackgroundModes& r) {
  double worst = 0;
  for (int t = 0; t < x.cols(); ++t) {
    const double difference = largest_part(background_at(x, l, t) - background_at(x, r, t));
    if (!(difference <= worst)) worst = difference;
  }
  return worst;
}

TEST(Solvers, AgreeOnTheNearestModeOfTwentyRandomWindows) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Clip clip = random_window(seed);
    const auto x = to_quaternions(clip);
    for (auto amplitude : {Amplitude::window, Amplitude::first_frame}) {
      const auto options = options_of(amplitude, 0, 0);
      const auto reference = solve(clip, Solver::adjoint, options);
      for (Solver solver : {Solver::gram, Solver::gram_extended, Solver::qr}) {
        SCOPED_TRACE(std::string(name_of(solver)) + ", window " + std::to_string(seed) + ", " +
                     describe(options));
        const auto modes = solve(clip, solver, options);
        ASSERT_EQ(modes.summary.rank, x.cols() - 1);
        ASSERT_EQ(modes.summary.background_modes, 1);
        // Conditions of these windows stay below 1e3: see picture_tolerance().
        EXPECT_LE(background_distance(x, modes, reference), 1e-10 * 255);
        EXPECT_LE(std::abs(modes.summary.lambda - reference.summary.lambda), 1e-10);
        // Backward stable, whatever the eigenvalue's own conditioning is.
        EXPECT_LE(modes.summary.residual, 64 * static_cast<double>(x.cols()) * kEpsilon);
      }
    }
  }
}

TEST(Solvers, AgreeOnAllModesAndTheirSum) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Clip clip = random_window(seed);
    const auto x = to_quaternions(clip);
    const auto options = options_of(Amplitude::window, 0, kInfinity);
    const auto reference = solve(clip, Solver::adjoint, options);
    for (Solver solver : {Solver::gram, Solver::gram_extended, Solver::qr}) {
      SCOPED_TRACE(std::string(name_of(solver)) + ", window " + std::to_string(seed));
      const auto modes = solve(clip, solver, options);
      ASSERT_EQ(modes.eigenvalues.size(), x.cols() - 1);
      ASSERT_EQ(reference.eigenvalues.size(), x.cols() - 1);
      // As sets: nearly equal |omega| may change places.
      for (Eigen::Index p = 0; p < modes.eigenvalues.size(); ++p)
        EXPECT_LE((reference.eigenvalues.array() - modes.eigenvalues(p)).abs().minCoeff(), 1e-10);
      EXPECT_NEAR(std::abs(modes.eigenvalues.sum() - reference.eigenvalues.sum()), 0, 1e-10);
    }
  }
}

TEST(Solvers, AgreeAtEveryLowRank) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Clip clip = random_window(seed);
    const auto x = to_quaternions(clip);
    for (int rank : {1, 2}) {
      const auto options = options_of(Amplitude::window, rank, 0);
      const auto reference = solve(clip, Solver::adjoint, options);
      for (Solver solver : {Solver::gram, Solver::gram_extended, Solver::qr}) {
        SCOPED_TRACE(std::string(name_of(solver)) + ", window " + std::to_string(seed) + ", " +
                     describe(options));
        const auto modes = solve(clip, solver, options);
        ASSERT_EQ(modes.summary.rank, rank);
        EXPECT_LE(background_distance(x, modes, reference), 1e-10 * 255);
      }
    }
  }
}

TEST(Solvers, DecomposeHandsThePictureOn) {
  // One call from a window, through pictures and weights.
  const Clip clip = random_window(4);
  const auto window = to_window(clip);
  const auto x = to_quaternions(clip);
  for (Solver solver : kSolvers) {
    SCOPED_TRACE(name_of(solver));
    DmdOptions options;
    options.solver = solver;
    const auto result = decompose(window, gram_of(window), options);
    const auto expected = background_at(x, solve(clip, solver, options), 1);
    Eigen::MatrixXd planes(3 * x.cols(), x.rows());
    for (int t = 0; t < x.cols(); ++t)
      for (int c = 0; c < kChannels; ++c)
        for (Eigen::Index p = 0; p < x.rows(); ++p)
          planes(3 * t + c, p) =
              clip.at(static_cast<size_t>(t), static_cast<size_t>(c), static_cast<size_t>(p));
    const Eigen::MatrixXd picture =
        result.background.weights(1) * (result.background.basis() * planes);
    double worst = 0;
    for (Eigen::Index p = 0; p < x.rows(); ++p) {
      const auto q = expected.get(p, 0);
      worst = std::max({worst, std::abs(picture(0, p) - q.x), std::abs(picture(1, p) - q.y),
                        std::abs(picture(2, p) - q.z)});
    }
    // Sums of 3 m products of size 255 and a power.
    EXPECT_LE(worst, 1e3 * static_cast<double>(x.cols()) * kEpsilon * 255);
  }
}

// ---- A camera that starts with a black frame ----

struct Start {
  Clip clip;
  std::vector<uint8_t> picture;
};
Start black_start(size_t pixels, size_t count, unsigned seed) {
  std::mt19937 rng(seed);
  const auto picture = random_picture(pixels, rng, 40, 215);
  std::normal_distribution<double> noise(0, 3);
  Clip clip(pixels, count);
  for (size_t t = 1; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels; ++p) clip.set(t, c, p, picture[c * pixels + p] + noise(rng));
  return {std::move(clip), picture};
}

// The mean of |L(t) - share * picture| over channels, pixels and the window.
double mean_error(const Start& start, const BackgroundModes& modes, double share) {
  const auto x = to_quaternions(start.clip);
  double sum = 0;
  for (int t = 0; t < x.cols(); ++t) {
    const auto l = background_at(x, modes, t);
    for (size_t p = 0; p < start.clip.pixels; ++p) {
      const auto q = l.get(static_cast<Eigen::Index>(p), 0);
      for (const auto& [level, c] : {std::pair{q.x, size_t{0}}, {q.y, size_t{1}}, {q.z, size_t{2}}})
        sum += std::abs(level - share * start.picture[c * start.clip.pixels + p]);
    }
  }
  return sum / static_cast<double>(start.picture.size() * start.clip.size());
}

TEST(Solvers, BlackFirstFrameLeavesTheBackground) {
  for (size_t count : {20u, 100u})
    for (size_t pixels : {101u, 499u})
      for (unsigned seed : {1u, 2u}) {
        const Start start = black_start(pixels, count, seed);
        for (int rank : {0, 1})
          for (Solver solver : kSolvers) {
            // Seconds for a hundred snapshots.
            if (solver == Solver::adjoint && count > 20) continue;
            SCOPED_TRACE(std::string(name_of(solver)) + ", rank " + std::to_string(rank) + ", m " +
                         std::to_string(count) + ", n " + std::to_string(pixels));
            const auto modes = solve(start.clip, solver, options_of(Amplitude::window, rank, 0));
            ASSERT_EQ(modes.summary.background_modes, 1);
            // One static mode fits m - 1 pictures and a black one with their mean: 1 / m darker
            // than the picture. The rest is a fraction of the noise; 4 levels are just above it.
            const double m = static_cast<double>(count);
            EXPECT_LE(mean_error(start, modes, (m - 1) / m), 1);
            if (count == 100) {
              EXPECT_LE(mean_error(start, modes, 1), 4);
            }
          }
      }
}

// ---- Fades: eigenvalues that are defective ----

TEST(Solvers, PolynomialFadesHaveSmallResiduals) {
  // A + t B + t^2 C, exact in 8 bits: a Jordan block at one as large as the rank.
  for (int degree : {1, 2, 3})
    for (size_t count : {6u, 8u, 10u}) {
      std::mt19937 rng(9);
      const int tops[] = {60, 2, 1, 1};
      Clip clip(61, count);
      for (size_t i = 0; i < clip.frames[0].size(); ++i) {
        int c[4] = {};
        for (int k = 0; k <= degree; ++k)
          c[k] = static_cast<int>(rng() % static_cast<unsigned>(tops[k] + 1));
        for (size_t t = 0; t < count; ++t) {
          const int s = static_cast<int>(t);
          clip.frames[t][i] = static_cast<uint8_t>(10 + c[0] + s * c[1] + s * (s - 1) / 2 * c[2] +
                                                   s * (s - 1) * (s - 2) / 6 * c[3]);
        }
      }
      for (Solver solver : kSolvers) {
        SCOPED_TRACE(std::string(name_of(solver)) + ", degree " + std::to_string(degree) + ", m " +
                     std::to_string(count));
        const auto modes = solve(clip, solver, {});
        ASSERT_EQ(modes.summary.rank, degree + 1);
        EXPECT_LE(modes.summary.residual, 64 * static_cast<double>(count) * kEpsilon);
        // The root of a perturbation of condition * epsilon, as many times as the block is large.
        EXPECT_LE(std::abs(modes.summary.lambda - 1.0),
                  4 * std::pow(modes.summary.condition * modes.summary.condition * kEpsilon,
                               1.0 / (degree + 1)));
      }
    }
}

// ---- Which solver `auto` takes below full rank ----

TEST(Automatic, TakesTheGramMatrixWhereAllThatIsLeftOutCameTwice) {
  std::mt19937 rng(10);
  const Clip pictures = noisy_clip(200, 12, 3, rng);
  Clip twice(200, 24), still(200, 10), lit(200, 10);
  for (size_t t = 0; t < 24; ++t) twice.frames[t] = pictures.frames[t / 2];
  for (size_t t = 0; t < 10; ++t) {
    still.frames[t] = pictures.frames[0];
    // Twice as bright: no frame comes again, and some depend on others.
    lit.frames[t] = pictures.frames[t / 2];
    for (uint8_t& level : lit.frames[t]) level = t % 2 == 0 ? level / 2 * 2 : level / 2;
  }
  DmdOptions options;
  options.solver = Solver::automatic;
  const auto solve_all = [&](const Clip& clip, Solver solver) {
    options.solver = solver;
    return quaternion_modes(to_window(clip), gram_of(to_window(clip)), options);
  };
  for (const auto& [clip, rank] : {std::pair{&twice, 12}, {&still, 1}}) {
    const auto modes = solve_all(*clip, Solver::automatic);
    const auto careful = solve_all(*clip, Solver::gram_extended);
    EXPECT_EQ(modes.summary.solver, Solver::gram);
    EXPECT_EQ(modes.summary.rank, rank);
    EXPECT_EQ(careful.summary.rank, rank);
    const double apart = background_distance(to_quaternions(*clip), modes, careful);
    EXPECT_LE(apart, modes.summary.rounding_bound + careful.summary.rounding_bound);
    // The Gram matrix has the square of the condition.
    EXPECT_LE(apart, picture_tolerance(std::pow(modes.summary.condition, 2)));
  }
  EXPECT_EQ(solve_all(lit, Solver::automatic).summary.solver, Solver::gram_extended);
  // Equal frames tell nothing of pairs of them, which this estimator works on.
  options.estimator = Estimator::total;
  options.rank = 14;
  EXPECT_EQ(solve_all(twice, Solver::automatic).summary.solver, Solver::gram_extended);
}

}  // namespace
}  // namespace qdmd::test
