// SPDX-License-Identifier: LGPL-2.1-or-later
// Q-DMD against its definition and against the paper's procedure.
#include <Eigen/QR>

#include "core/dmd/qdmd.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// ---- The Gram matrix against the paper's procedure ----

TEST(Qdmd, GramAgreesWithTheAdjointOnEveryClip) {
  int several_modes = 0;
  for (const auto& [name, clip] : clips()) {
    const auto x = to_quaternions(clip);
    const auto g = quaternion_gram_of(clip);
    for (const auto& options : every_option()) {
      SCOPED_TRACE(std::string(name) + ", " + describe(options));
      const auto from_gram = qdmd_from_gram(g, options);
      const auto from_adjoint = qdmd_from_adjoint(x, options);
      ASSERT_TRUE(from_gram.summary.converged && from_adjoint.summary.converged);
      ASSERT_EQ(from_gram.summary.rank, from_adjoint.summary.rank);
      ASSERT_EQ(from_gram.summary.background_modes, from_adjoint.summary.background_modes);
      if (from_gram.summary.background_modes > 1) ++several_modes;
      const double tolerance = picture_tolerance(from_gram.summary.condition);
      ASSERT_LE(tolerance, 1e-9 * 255);
      double worst = 0;
      for (int t = 0; t < x.cols(); ++t) {
        const double difference =
            largest_part(background_at(x, from_gram, t) - background_at(x, from_adjoint, t));
        if (!(difference <= worst)) worst = difference;
      }
      EXPECT_LE(worst, tolerance);
      // Relative to levels of 255, so eigenvalues keep 255 times more digits at least.
      EXPECT_LE(std::abs(from_gram.summary.lambda - from_adjoint.summary.lambda), tolerance / 255);
      EXPECT_EQ(from_gram.summary.omega, omega_magnitude(from_gram.summary.lambda));
      // Backward stable Schur form: 50 m epsilon, m <= 15.
      EXPECT_LE(from_gram.summary.residual, 50 * 15 * kEpsilon);
    }
  }
  EXPECT_GE(several_modes, 20) << "the clips have to exercise sums of modes";
}

TEST(Qdmd, RankLimitsTheDecomposition) {
  std::mt19937 rng(72);
  const Clip clip = noisy_clip(60, 8, 5, rng);
  const auto g = quaternion_gram_of(clip);
  for (int rank : {0, 1, 3, 7, 100}) {
    DmdOptions options;
    options.rank = rank;
    const int expected = rank == 0 ? 7 : std::min(rank, 7);
    EXPECT_EQ(qdmd_from_gram(g, options).summary.rank, expected);
    EXPECT_EQ(qdmd_from_adjoint(to_quaternions(clip), options).summary.rank, expected);
  }
}

// ---- The definition of a dynamic mode ----

// Q = Y X^+ never formed: Q phi = Y (X^+ phi), least squares on the complex adjoint.
QuaternionMatrixd operator_times(const QuaternionMatrixd& x, const QuaternionMatrixd& phi) {
  const auto past = x.left_cols(x.cols() - 1), future = x.right_cols(x.cols() - 1);
  Eigen::MatrixXcd rhs(2 * phi.rows(), phi.cols());
  rhs << phi.a, -phi.b.conjugate();
  const Eigen::MatrixXcd solution = past.adjoint().completeOrthogonalDecomposition().solve(rhs);
  return future * QuaternionMatrixd::from_adjoint_columns(solution);
}

TEST(Qdmd, ModesAreEigenvectorsOfTheOperatorThatAdvancesFrames) {
  for (const auto& [name, clip] : clips()) {
    SCOPED_TRACE(name);
    const auto x = to_quaternions(clip);
    DmdOptions options;
    options.omega_threshold = kInfinity;  // every mode
    const auto modes = qdmd_from_gram(quaternion_gram_of(clip), options);
    ASSERT_EQ(modes.eigenvalues.size(), x.cols() - 1);
    const auto phi = x * modes.combination;
    const auto advanced = operator_times(x, phi);
    for (Eigen::Index p = 0; p < modes.eigenvalues.size(); ++p) {
      auto expected = phi.col(p);
      expected.scale_col(0, Quaterniond(modes.eigenvalues(p)));
      EXPECT_GE(modes.eigenvalues(p).imag(), 0);
      // phi has unit coefficients over singular values: the last digits of the smallest singular
      // value, known to condition^2 epsilon, are in the combination.
      const double condition = modes.summary.condition;
      EXPECT_LE(distance(advanced.col(p), expected), 100 * condition * condition * kEpsilon *
                                                         (1 + std::abs(modes.eigenvalues(p))) *
                                                         phi.col(p).norm())
          << p;
    }
  }
}

// x_t = sum_p phi_p lambda_p^t, quaternion phi: an exact linear model.
QuaternionMatrixd linear_model(const QuaternionMatrixd& phi, const Eigen::VectorXcd& lambda,
                               int count) {
  QuaternionMatrixd x(phi.rows(), count);
  for (int t = 0; t < count; ++t)
    for (Eigen::Index p = 0; p < phi.cols(); ++p) {
      auto term = phi.col(p);
      term.scale_col(0, Quaterniond(integer_power(lambda(p), t)));
      x.a.col(t) += term.a;
      x.b.col(t) += term.b;
    }
  return x;
}

TEST(Qdmd, AllModesReproduceAnExactLinearModel) {
  std::mt19937 rng(73);
  const Eigen::VectorXcd lambda{{1.0, {0.0, 0.9}, {-0.7, 0.4}}};
  const int count = 9;
  const auto x = linear_model(random_matrix(50, 3, rng), lambda, count);
  for (auto amplitude : {Amplitude::window, Amplitude::first_frame}) {
    const auto options = options_of(amplitude, 0, kInfinity);
    for (const auto& modes :
         {qdmd_from_gram(x.conjugate_transpose() * x, options), qdmd_from_adjoint(x, options)}) {
      ASSERT_EQ(modes.summary.rank, 3);
      ASSERT_EQ(modes.eigenvalues.size(), 3);
      // condition < 10, and its square times a few sums of 50 terms.
      const double tolerance = 1e4 * kEpsilon;
      for (Eigen::Index p = 0; p < 3; ++p)
        EXPECT_LE((lambda.array() - modes.eigenvalues(p)).abs().minCoeff(), tolerance);
      for (int t = 0; t < count; ++t)
        EXPECT_LE(distance(background_at(x, modes, t), x.col(t)), tolerance * x.norm());
    }
  }
}

TEST(Qdmd, AllModesReproduceAnIntegerLinearModel) {
  // A + (-1)^t B + 2^t C and a colour that turns a quarter a frame: eigenvalues 1, -1, 2, i in
  // pixels that are exact.
  std::mt19937 rng(74);
  const size_t pixels = 60, count = 7;
  std::uniform_int_distribution<int> a(60, 120), b(0, 20), c(0, 1), d(-20, 20);
  Clip clip(pixels, count);
  for (size_t i = 0; i < 3 * pixels; ++i) {
    const int levels[] = {a(rng), b(rng), c(rng), d(rng), d(rng)};
    for (size_t t = 0; t < count; ++t) {
      const int turn[] = {levels[3], levels[4], -levels[3], -levels[4]};
      clip.frames[t][i] = static_cast<uint8_t>(levels[0] + (t % 2 ? -1 : 1) * levels[1] +
                                               (1 << t) * levels[2] + turn[t % 4]);
    }
  }
  const auto x = to_quaternions(clip);
  for (auto amplitude : {Amplitude::window, Amplitude::first_frame}) {
    const auto modes =
        qdmd_from_gram(quaternion_gram_of(clip), options_of(amplitude, 0, kInfinity));
    ASSERT_EQ(modes.summary.rank, 5) << "1, -1, 2 and twice the class of i";
    const double condition = modes.summary.condition;
    // lambda = 2 grows 64-fold, on top of condition^2.
    const double tolerance = 64 * condition * condition * kEpsilon * 255;
    for (int t = 0; t < static_cast<int>(count); ++t)
      EXPECT_LE(largest_part(background_at(x, modes, t) - x.col(t)), tolerance) << t;
  }
}

// ---- Window amplitudes are the least-squares optimum ----

double squared_residual(const QuaternionMatrixd& x, const BackgroundModes& modes) {
  double sum = 0;
  for (int t = 0; t < x.cols(); ++t) sum += (background_at(x, modes, t) - x.col(t)).squared_norm();
  return sum;
}

TEST(Qdmd, NoOtherAmplitudesFitTheWindowBetter) {
  std::mt19937 rng(75);
  for (double threshold : {0.0, 1.0, 2.0}) {
    for (const auto& [name, clip] : clips()) {
      SCOPED_TRACE(std::string(name) + ", threshold " + std::to_string(threshold));
      const auto x = to_quaternions(clip);
      const auto modes =
          qdmd_from_gram(quaternion_gram_of(clip), options_of(Amplitude::window, 0, threshold));
      const double best = squared_residual(x, modes);
      for (int repeat = 0; repeat < 10; ++repeat) {
        const auto p = static_cast<Eigen::Index>(rng() % modes.eigenvalues.size());
        const double step = modes.amplitudes.get(p, 0).norm() * (repeat % 2 ? 1e-2 : 1e-4);
        const auto change = random_quaternion(rng).unit() * step;
        auto other = modes, only_change = modes;
        other.amplitudes.set(p, 0, modes.amplitudes.get(p, 0) + change);
        only_change.amplitudes = QuaternionMatrixd(modes.amplitudes.rows(), 1);
        only_change.amplitudes.set(p, 0, change);
        const double worse = squared_residual(x, other) - best;
        // At the optimum the gradient is zero: the sum of squares grows by the change's own
        // square. The sum itself is rounded to some m n terms, and the gradient is zero to
        // within rounding times condition.
        double change_squared = 0;
        for (int t = 0; t < x.cols(); ++t)
          change_squared += background_at(x, only_change, t).squared_norm();
        const double tolerance = 1e3 * kEpsilon * best + 400 * modes.summary.condition * kEpsilon *
                                                             x.norm() * std::sqrt(change_squared);
        EXPECT_NEAR(worse, change_squared, tolerance);
        EXPECT_GE(worse, -tolerance);
        if (repeat % 2) {
          EXPECT_GT(change_squared, tolerance) << "the test has to see something";
        }
      }
    }
  }
}

}  // namespace
}  // namespace qdmd::test
