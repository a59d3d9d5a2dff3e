// Every solver against the paper's procedure, on windows that have a decomposition.
#include "core/dmd/decompose.h"
#include "core/dmd/qdmd.h"
#include "core/quaternion/schur.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

constexpr Solver kSolvers[] = {Solver::gram, Solver::gram_extended, Solver::qr, Solver::adjoint};

const char* name_of(Solver solver) {
  switch (solver) {
    case Solver::gram:
      return "gram";
    case Solver::gram_extended:
      return "gram-extended";
    case Solver::qr:
      return "qr";
    case Solver::adjoint:
      return "adjoint";
  }
  return "";
}

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
          planes(3 * t + c, p) = clip.at(static_cast<size_t>(t), static_cast<size_t>(c),
                                         static_cast<size_t>(p));
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
