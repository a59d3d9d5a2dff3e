// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/quaternion/quaternion.h"

#include <vector>

#include "core/quaternion/matrix.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

const Quaterniond kI{0, 1, 0, 0}, kJ{0, 0, 1, 0}, kK{0, 0, 0, 1};

// ---- Scalars ----

TEST(Quaternion, UnitsMultiplyAsHamiltonCarved) {
  EXPECT_EQ(distance(kI * kJ, kK), 0);
  EXPECT_EQ(distance(kJ * kK, kI), 0);
  EXPECT_EQ(distance(kK * kI, kJ), 0);
  EXPECT_EQ(distance(kJ * kI, -kK), 0);
  EXPECT_EQ(distance(kK * kJ, -kI), 0);
  EXPECT_EQ(distance(kI * kK, -kJ), 0);
  for (const auto& unit : {kI, kJ, kK}) EXPECT_EQ(distance(unit * unit, Quaterniond(-1.0)), 0);
}

TEST(Quaternion, AlgebraOfRandomNumbers) {
  std::mt19937 rng(1);
  for (int i = 0; i < 200; ++i) {
    const auto p = random_quaternion(rng), q = random_quaternion(rng), r = random_quaternion(rng);
    const double pq = p.norm() * q.norm();
    // A product has four sums of four terms: at most 4 roundings deep, 8 for two in a row.
    EXPECT_LE(distance((p * q) * r, p * (q * r)), 16 * kEpsilon * pq * r.norm());
    EXPECT_LE(distance((p * q).conj(), q.conj() * p.conj()), 8 * kEpsilon * pq);
    EXPECT_NEAR((p * q).norm(), pq, 8 * kEpsilon * pq);
    EXPECT_LE(distance(p * p.conj(), Quaterniond(p.squared_norm())),
              8 * kEpsilon * p.squared_norm());
    EXPECT_LE(distance(p * (q + r), p * q + p * r),
              16 * kEpsilon * p.norm() * (q + r).norm() + 16 * kEpsilon * pq);
  }
}

TEST(Quaternion, PairOfComplexNumbers) {
  const Quaterniond q{1, 2, 3, 4};
  EXPECT_EQ(q.a(), std::complex<double>(1, 2));
  EXPECT_EQ(q.b(), std::complex<double>(3, 4));
  EXPECT_EQ(distance(Quaterniond(q.a()) + Quaterniond(q.b()) * kJ, q), 0);
  EXPECT_EQ(distance(Quaterniond(q.a(), q.b()), q), 0);
}

TEST(Quaternion, UnitOfZeroIsAPhase) {
  EXPECT_EQ(distance(Quaterniond().unit(), Quaterniond(1.0)), 0);
  // One division and one product round.
  EXPECT_NEAR((Quaterniond{3, -4, 12, 84}).unit().norm(), 1, 4 * kEpsilon);
}

// The definition, summed until terms vanish; good for |q| up to a few.
Quaterniond exp_series(const Quaterniond& q) {
  Quaterniond sum(1.0), term(1.0);
  for (int n = 1; n < 60; ++n) {
    term = term * q * (1.0 / n);
    sum += term;
  }
  return sum;
}

// Also where squares underflow or overflow.
TEST(Quaternion, InverseAndUnitOfAnySize) {
  const Quaterniond q(0.5, -1, 0.25, 2);
  for (double size : {1e-300, 1e-170, 1e-150, 1.0, 1e150, 1e300}) {
    const Quaterniond unit = (q * size).unit(), one = (q * size) * (q * size).inverse();
    EXPECT_LE(distance(unit, q.unit()), 8 * kEpsilon) << size;
    EXPECT_LE(distance(one, Quaterniond(1.0)), 16 * kEpsilon) << size;
  }
}

TEST(QuaternionExp, EqualsItsPowerSeries) {
  std::mt19937 rng(2);
  for (int i = 0; i < 100; ++i) {
    const auto q = random_quaternion(rng);
    // The terms of the series sum to exp(|q|) in size, about 10 roundings in each that matters.
    EXPECT_LE(distance(exp(q), exp_series(q)), 16 * kEpsilon * std::exp(q.norm()));
  }
}

TEST(QuaternionExp, SpecialNumbers) {
  EXPECT_EQ(distance(exp(Quaterniond()), Quaterniond(1.0)), 0);
  EXPECT_EQ(distance(exp(Quaterniond(2.0)), Quaterniond(std::exp(2.0))), 0);
  // cos and sin of a rounded pi / 2.
  EXPECT_LE(distance(exp(kJ * (M_PI / 2)), kJ), 4 * kEpsilon);
  const Quaterniond tiny{0, 1e-8, -2e-8, 3e-8};
  EXPECT_LE(distance(exp(tiny), exp_series(tiny)), 4 * kEpsilon);
  // Relative accuracy of the vector part, which 1 + tiny would hide.
  EXPECT_NEAR(exp(tiny).z, 3e-8, 4 * kEpsilon * 3e-8);
}

TEST(QuaternionLog, UndoneByExp) {
  std::mt19937 rng(3);
  for (int i = 0; i < 100; ++i) {
    const auto q = random_quaternion(rng);
    // |log q| up to about 4 is rounded absolutely and exp turns that into a relative error.
    EXPECT_LE(distance(exp(log(q)), q), 16 * kEpsilon * q.norm());
    Quaterniond pure = q;
    pure.w = 0;
    EXPECT_LE(distance(exp(log(pure)), pure), 16 * kEpsilon * pure.norm());
    Quaterniond nearly_real = q;
    nearly_real.x *= 1e-8, nearly_real.y *= 1e-8, nearly_real.z *= 1e-8;
    EXPECT_LE(distance(exp(log(nearly_real)), nearly_real), 16 * kEpsilon * nearly_real.norm());
  }
  for (double real : {2.5, 1.0, 1e-3, -1e-3, -1.0, -7.0}) {
    const Quaterniond q(real);
    EXPECT_LE(distance(exp(log(q)), q), 16 * kEpsilon * std::abs(real)) << real;
  }
}

TEST(QuaternionLog, UndoesExpOnThePrincipalBranch) {
  std::mt19937 rng(4);
  for (int i = 0; i < 100; ++i) {
    auto q = random_quaternion(rng);
    // |V| at most 3 < pi stays on the branch and away from its cut.
    if (q.vector_norm() > 3) continue;
    EXPECT_LE(distance(log(exp(q)), q), 64 * kEpsilon * (1 + q.norm()))
        << "near the cut the axis is V / sin(3), 7 times its error";
    for (double tiny : {1e-8, 1e-12}) {
      const Quaterniond small{q.w, q.x * tiny, q.y * tiny, q.z * tiny};
      // The vector part keeps its relative accuracy.
      EXPECT_NEAR(log(exp(small)).y, small.y, 16 * kEpsilon * small.vector_norm());
    }
  }
}

TEST(QuaternionLog, EveryQuadrant) {
  // atan2, not atan: a negative real part turns the angle past a right angle.
  const Quaterniond obtuse{-1, 0, 1, 0};
  EXPECT_NEAR(log(obtuse).y, 3 * M_PI / 4, 4 * kEpsilon);
  EXPECT_NEAR(log(obtuse).w, std::log(2.0) / 2, 4 * kEpsilon);
}

TEST(QuaternionLog, RealNumbers) {
  EXPECT_EQ(distance(log(Quaterniond(1.0)), Quaterniond()), 0);
  EXPECT_NEAR(log(Quaterniond(3.0)).w, std::log(3.0), 2 * kEpsilon);
  EXPECT_EQ(log(Quaterniond(3.0)).vector_norm(), 0);
  // Documented: a negative real takes the axis i, as the principal complex logarithm does.
  const auto negative = log(Quaterniond(-2.0));
  const auto complex_log = std::log(std::complex<double>(-2.0));
  EXPECT_LE(distance(negative, Quaterniond(complex_log)), 4 * kEpsilon);
}

TEST(QuaternionLog, ZeroIsMinusInfinity) {
  const auto q = log(Quaterniond());
  EXPECT_EQ(q.w, -kInfinity);
  EXPECT_EQ(q.vector_norm(), 0);
  EXPECT_EQ(exp(q).norm(), 0);
}

void expect_standardized(const Quaterniond& q) {
  const auto d = standardizing_rotation(q);
  // Built of four sums and one normalization.
  EXPECT_NEAR(d.norm(), 1, 8 * kEpsilon);
  // d is at least 1 long before it is normalized, so two products' rounding remains.
  EXPECT_LE(distance(d.conj() * q * d, Quaterniond(q.w, q.vector_norm(), 0, 0)),
            32 * kEpsilon * q.norm())
      << q.w << ' ' << q.x << ' ' << q.y << ' ' << q.z;
}

TEST(StandardizingRotation, TurnsTheVectorPartToI) {
  std::mt19937 rng(5);
  for (int i = 0; i < 100; ++i) expect_standardized(random_quaternion(rng));
  for (const auto& axis : {kI, -kI, kJ, -kJ, kK, -kK}) {
    expect_standardized(axis);
    expect_standardized(axis * 1e-8 + Quaterniond(1.0));
  }
  // u + i cancels near -i: the other branch has to take over.
  for (double off : {1e-4, 1e-8, 1e-12, 1e-16, 1e-200}) {
    expect_standardized({0.5, -1, off, 0});
    expect_standardized({0.5, -1, 0, -off});
    expect_standardized({0, -off, 1, 0});
  }
}

TEST(StandardizingRotation, LeavesRealNumbersAlone) {
  for (double real : {0.0, 1.0, -1.0})
    EXPECT_EQ(distance(standardizing_rotation(Quaterniond(real)), Quaterniond(1.0)), 0);
  EXPECT_LE(distance(standardizing_rotation(kI), kI), 0) << "any complex phase would do";
}

// ---- Matrices ----

TEST(QuaternionMatrix, ProductIsTheSumOfScalarProducts) {
  std::mt19937 rng(6);
  const auto p = random_matrix(4, 7, rng), q = random_matrix(7, 3, rng);
  QuaternionMatrixd expected(4, 3);
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 3; ++c) {
      Quaterniond sum;
      for (int k = 0; k < 7; ++k) sum += p.get(r, k) * q.get(k, c);
      expected.set(r, c, sum);
    }
  // 7 terms of 4 products each; 28 roundings bound a sum.
  EXPECT_LE(distance(p * q, expected), 28 * kEpsilon * p.norm() * q.norm());
}

TEST(QuaternionMatrix, ConjugateTransposeReversesProducts) {
  std::mt19937 rng(7);
  const auto p = random_matrix(5, 6, rng), q = random_matrix(6, 4, rng);
  EXPECT_LE(
      distance((p * q).conjugate_transpose(), q.conjugate_transpose() * p.conjugate_transpose()),
      48 * kEpsilon * p.norm() * q.norm());  // 24 roundings on either side
  EXPECT_EQ(distance(p.conjugate_transpose().get(2, 3), p.get(3, 2).conj()), 0);
}

TEST(QuaternionMatrix, FrobeniusNorm) {
  std::mt19937 rng(8);
  const auto p = random_matrix(6, 5, rng);
  double squared = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 5; ++c) squared += p.get(r, c).squared_norm();
  EXPECT_NEAR(p.norm(), std::sqrt(squared), 30 * kEpsilon * p.norm());  // 30 terms
}

TEST(QuaternionMatrix, AdjointIsAHomomorphism) {
  std::mt19937 rng(9);
  const auto p = random_matrix(3, 5, rng), q = random_matrix(5, 4, rng);
  const Eigen::MatrixXcd product = p.adjoint() * q.adjoint();
  // 10 complex terms on one side, 5 quaternion terms on the other.
  EXPECT_LE(((p * q).adjoint() - product).norm(), 40 * kEpsilon * p.norm() * q.norm());
  EXPECT_EQ((p.conjugate_transpose().adjoint() - p.adjoint().adjoint()).norm(), 0);
  EXPECT_EQ((QuaternionMatrixd::identity(3).adjoint() - Eigen::MatrixXcd::Identity(6, 6)).norm(),
            0);
}

TEST(QuaternionMatrix, AdjointAndBack) {
  std::mt19937 rng(10);
  const auto p = random_matrix(4, 6, rng);
  EXPECT_EQ(distance(QuaternionMatrixd::from_adjoint(p.adjoint()), p), 0);
  EXPECT_EQ(
      distance(QuaternionMatrixd::from_adjoint_columns(p.adjoint().leftCols(2)), p.left_cols(2)),
      0);
}

TEST(QuaternionMatrix, ScalesRowsFromTheLeftAndColumnsFromTheRight) {
  std::mt19937 rng(11);
  const auto p = random_matrix(4, 3, rng);
  const auto s = random_quaternion(rng);
  auto by_col = p, by_row = p;
  by_col.scale_col(1, s);
  by_row.scale_row(2, s);
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 3; ++c) {
      const auto q = p.get(r, c);
      // One product, formed in two ways.
      const double tolerance = 8 * kEpsilon * q.norm() * s.norm();
      EXPECT_LE(distance(by_col.get(r, c), c == 1 ? q * s : q), tolerance);
      EXPECT_LE(distance(by_row.get(r, c), r == 2 ? s * q : q), tolerance);
    }
}

TEST(QuaternionMatrix, BlocksAndRealColumnScales) {
  std::mt19937 rng(12);
  const auto p = random_matrix(4, 5, rng);
  EXPECT_EQ(distance(p.block(1, 2, 2, 3).get(1, 2), p.get(2, 4)), 0);
  EXPECT_EQ(distance(p.right_cols(2).get(3, 0), p.get(3, 3)), 0);
  EXPECT_EQ(distance(p.left_cols(2).get(3, 1), p.get(3, 1)), 0);
  EXPECT_EQ(distance(p.col(4), p.block(0, 4, 4, 1)), 0);
  const auto scaled = p.scale_cols(Eigen::VectorXd::LinSpaced(5, 0, 4));
  for (int c = 0; c < 5; ++c) EXPECT_EQ(distance(scaled.get(2, c), p.get(2, c) * double(c)), 0);
}

TEST(QuaternionMatrix, FindsNaNInEitherPart) {
  QuaternionMatrixd m(2, 2);
  EXPECT_TRUE(m.all_finite());
  m.b(1, 0) = {0, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_FALSE(m.all_finite());
}

}  // namespace
}  // namespace qdmd::test
