// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/quaternion/factorize.h"

#include "core/quaternion/hermitian.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// ---- Reflectors ----

TEST(Reflector, SendsItsColumnToTheFirstAxis) {
  std::mt19937 rng(21);
  for (Eigen::Index size : {1, 2, 3, 10, 40}) {
    const auto x = random_matrix(size, 1, rng);
    const auto h = make_reflector(x);
    auto hx = x;
    apply_left(h, hx, 0, 0, 1);
    QuaternionMatrixd expected(size, 1);
    expected.set(0, 0, h.alpha);
    // Inner product, norm and update: each sums `size` quaternion products.
    const double tolerance = 8 * static_cast<double>(size) * kEpsilon;
    EXPECT_LE(distance(hx, expected), tolerance * x.norm());
    EXPECT_NEAR(h.alpha.norm(), x.norm(), tolerance * x.norm());

    auto matrix = QuaternionMatrixd::identity(size);
    apply_left(h, matrix, 0, 0, size);
    EXPECT_LE(orthonormality_error(matrix), tolerance * std::sqrt(static_cast<double>(size)));
    EXPECT_LE(distance(matrix, matrix.conjugate_transpose()), tolerance) << "Hermitian";
  }
}

TEST(Reflector, OfAColumnWhoseSquaresUnderflow) {
  std::mt19937 rng(29);
  for (double size : {1e-290, 1e-170, 1e-158, 1e160}) {
    const auto x = random_matrix(5, 1, rng).scale_cols(Eigen::VectorXd::Constant(1, size));
    const auto h = make_reflector(x);
    auto matrix = QuaternionMatrixd::identity(5);
    apply_left(h, matrix, 0, 0, 5);
    EXPECT_LE(orthonormality_error(matrix), 100 * kEpsilon) << size;
    // A power of two past the range of squares.
    const double scale = std::ldexp(1.0, -std::ilogb(size));
    const auto large = x.scale_cols(Eigen::VectorXd::Constant(1, scale));
    EXPECT_LE(distance(h.alpha * scale, make_reflector(large).alpha), 100 * kEpsilon) << size;
  }
}

TEST(Reflector, OfZeroIsTheIdentity) {
  const auto h = make_reflector(QuaternionMatrixd(5, 1));
  EXPECT_EQ(h.tau, 0);
  EXPECT_EQ(h.alpha.norm(), 0);
  std::mt19937 rng(22);
  const auto before = random_matrix(5, 2, rng);
  auto m = before;
  apply_left(h, m, 0, 0, 2);
  EXPECT_EQ(distance(m, before), 0);
}

TEST(Reflector, OfAColumnWithZeroHead) {
  QuaternionMatrixd x(3, 1);
  x.set(2, 0, {0, 0, -2, 0});
  const auto h = make_reflector(x);
  apply_left(h, x, 0, 0, 1);
  EXPECT_NEAR(x.get(0, 0).norm(), 2, 8 * kEpsilon);
  EXPECT_LE(x.block(1, 0, 2, 1).norm(), 8 * kEpsilon);  // a handful of roundings of size 2
}

TEST(Reflector, AppliesToABlockFromEitherSide) {
  std::mt19937 rng(23);
  const auto m = random_matrix(6, 6, rng);
  const auto h = make_reflector(random_matrix(3, 1, rng));
  auto small = QuaternionMatrixd::identity(3);
  apply_left(h, small, 0, 0, 3);
  auto whole = QuaternionMatrixd::identity(6);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) whole.set(2 + r, 2 + c, small.get(r, c));
  auto left = m, right = m;
  apply_left(h, left, 2, 0, 6);
  apply_right(h, right, 0, 6, 2);
  // Six-term sums against three-term ones.
  EXPECT_LE(distance(left, whole * m), 32 * kEpsilon * m.norm());
  EXPECT_LE(distance(right, m * whole), 32 * kEpsilon * m.norm());
}

// ---- QR ----

void expect_qr(const QuaternionMatrixd& m) {
  const auto [q, r] = qr(m);
  const Eigen::Index k = std::min(m.rows(), m.cols());
  ASSERT_EQ(q.rows(), m.rows());
  ASSERT_EQ(q.cols(), k);
  ASSERT_EQ(r.rows(), k);
  ASSERT_EQ(r.cols(), m.cols());
  // Householder QR: k reflectors, each off by a small multiple of epsilon (Higham, theorem 19.4).
  const double tolerance = 16 * static_cast<double>(k) * kEpsilon;
  EXPECT_LE(orthonormality_error(q), tolerance * std::sqrt(static_cast<double>(k)));
  EXPECT_LE(distance(q * r, m), tolerance * m.norm());
  for (Eigen::Index i = 0; i < k; ++i) {
    EXPECT_EQ(r.get(i, i).vector_norm(), 0);
    EXPECT_GE(r.get(i, i).w, 0);
    for (Eigen::Index j = 0; j < i; ++j) EXPECT_EQ(r.get(i, j).norm(), 0);
  }
  EXPECT_EQ(distance(qr(m, false).r, r), 0) << "r does not depend on with_q";
}

TEST(Qr, EveryShape) {
  std::mt19937 rng(24);
  const std::pair<int, int> shapes[] = {{1, 1}, {5, 1}, {1, 5}, {20, 6}, {6, 20}, {9, 9}, {60, 30}};
  for (const auto& [rows, cols] : shapes) expect_qr(random_matrix(rows, cols, rng));
}

TEST(Qr, RankDeficient) {
  std::mt19937 rng(25);
  expect_qr(random_matrix(12, 3, rng) * random_matrix(3, 8, rng));
  const auto column = random_matrix(10, 1, rng);
  QuaternionMatrixd repeated(10, 4);
  for (int c = 0; c < 4; ++c) {
    repeated.a.col(c) = column.a;
    repeated.b.col(c) = column.b;
  }
  expect_qr(repeated);
}

TEST(Qr, ZeroColumns) {
  std::mt19937 rng(26);
  auto m = random_matrix(8, 5, rng);
  for (int c : {0, 3}) {
    m.a.col(c).setZero();
    m.b.col(c).setZero();
  }
  expect_qr(m);
  expect_qr(QuaternionMatrixd(6, 4));
}

// ---- Cholesky and triangular solves ----

TEST(Cholesky, FactorsAGramMatrix) {
  std::mt19937 rng(27);
  // Around the width of a panel, and several.
  for (int size : {1, 2, 7, 23, 24, 25, 49, 80}) {
    const auto x = random_matrix(3 * size, size, rng);
    const auto g = x.conjugate_transpose() * x;
    const auto factor = cholesky(g, 4 * size * kEpsilon);
    ASSERT_TRUE(factor.complete());
    const auto& r = factor.r;
    // Higham, theorem 10.3: (size + 1) roundings of 4-product terms, |R|^2 = trace of G.
    const double tolerance = 8 * (size + 1) * kEpsilon * r.squared_norm();
    EXPECT_LE(distance(r.conjugate_transpose() * r, g), tolerance);
    for (int i = 0; i < size; ++i) {
      EXPECT_EQ(r.get(i, i).vector_norm(), 0);
      EXPECT_GT(r.get(i, i).w, 0);
      for (int j = 0; j < i; ++j) EXPECT_EQ(r.get(i, j).norm(), 0);
    }
    // A well conditioned Gram matrix (about 10): the R of the QR, to within that much more.
    EXPECT_LE(distance(r, qr(x, false).r), 100 * (size + 1) * kEpsilon * r.norm());
  }
}

TEST(Cholesky, ReadsTheLowerTriangleOnly) {
  std::mt19937 rng(28);
  const int size = 30;
  const auto x = random_matrix(2 * size, size, rng);
  const auto g = x.conjugate_transpose() * x;
  auto lower = g;
  for (int c = 1; c < size; ++c)
    for (int r = 0; r < c; ++r) lower.set(r, c, Quaterniond(std::nan("")));
  const auto whole_factor = cholesky(g, kEpsilon), lower_factor = cholesky(lower, kEpsilon);
  ASSERT_TRUE(whole_factor.complete() && lower_factor.complete());
  EXPECT_EQ(distance(whole_factor.r, lower_factor.r), 0);
}

TEST(Cholesky, StopsAtTheRank) {
  std::mt19937 rng(29);
  // In the first panel, at its end, behind it.
  for (int rank : {0, 1, 3, 24, 31}) {
    const int size = 40;
    const auto deficient = random_matrix(rank, size, rng);
    const auto g = deficient.conjugate_transpose() * deficient;
    const auto factor = cholesky(g, 4 * size * kEpsilon);
    EXPECT_EQ(factor.pivots, rank);
    EXPECT_EQ(factor.r.rows(), rank);
    EXPECT_EQ(factor.r.cols(), size);
    EXPECT_EQ(factor.complete(), false);
    // Leading columns of random matrices: the condition number, squared, stays below 1e5.
    EXPECT_LE(distance(factor.r.conjugate_transpose() * factor.r, g),
              1e5 * 8 * size * kEpsilon * g.norm());
  }
  // Exactly equal columns leave an exact zero pivot; tolerance 0 has to refuse it too.
  QuaternionMatrixd ones(2, 2);
  ones.a.setConstant(4.0);
  EXPECT_EQ(cholesky(ones, 0.0).pivots, 1);
  auto indefinite = QuaternionMatrixd::identity(3);
  indefinite.a(2, 2) = -1;
  EXPECT_EQ(cholesky(indefinite, 0.0).pivots, 2);
}

TEST(PivotedCholesky, FactorsAnyRankInTheOrderOfTheColumns) {
  std::mt19937 rng(33);
  for (int size : {1, 5, 40})
    for (int rank : {0, 1, size / 2, size}) {
      auto x = random_matrix(rank, size, rng);
      // A first column of zeros stops the factorization in order.
      if (rank < size) {
        x.a.col(0).setZero();
        x.b.col(0).setZero();
      }
      const auto g = x.conjugate_transpose() * x;
      const auto factor = pivoted_cholesky(g, 4 * size * kEpsilon);
      EXPECT_EQ(factor.pivots, std::min(rank, rank < size ? size - 1 : size));
      // Backward stable without the condition number (Higham, theorem 10.14).
      EXPECT_LE(distance(factor.r.conjugate_transpose() * factor.r, g),
                64 * size * kEpsilon * g.norm() + 1e-300);
    }
}

TEST(ConditionEstimate, IsALowerBoundNearTheTruth) {
  std::mt19937 rng(34);
  for (int size : {1, 2, 10, 40})
    for (double condition : {1.0, 1e3, 1e8, 1e13}) {
      Eigen::VectorXcd values(size);
      for (int k = 0; k < size; ++k)
        values(k) = std::pow(condition, -static_cast<double>(k) / std::max(1, size - 1));
      const auto r =
          qr(random_unitary(size, rng) * diagonal(values) * random_unitary(size, rng), false).r;
      const double truth = size > 1 ? condition : 1;
      const double estimate = condition_estimate(ScalarGrid<double>(r));
      // The smallest singular value itself is only good to epsilon times the largest.
      const double tolerance = 100 * size * kEpsilon * condition;
      EXPECT_LE(estimate, truth * (1 + tolerance)) << size << ' ' << condition;
      EXPECT_GE(estimate, truth / 3) << size << ' ' << condition;
    }
}

// Repeated columns leave pivots of epsilon, epsilon^2, ..: their inverses overflow.
TEST(ConditionEstimate, IsInfiniteWherePivotsVanish) {
  for (double least : {1e-160, 1e-300, 0.0}) {
    QuaternionMatrixd r = QuaternionMatrixd::identity(6);
    for (Eigen::Index k = 3; k < 6; ++k) r.set(k, k, Quaterniond(least));
    EXPECT_EQ(condition_estimate(ScalarGrid<double>(r)), kInfinity) << least;
  }
}

TEST(SolveUpper, SolvesWithQuaternionPivots) {
  std::mt19937 rng(30);
  for (int size : {1, 2, 8, 20}) {
    auto r = qr(random_matrix(2 * size, size, rng), false).r;
    for (int i = 0; i < size; ++i) r.set(i, i, r.get(i, i) * random_quaternion(rng).unit());
    const auto b = random_matrix(size, 3, rng);
    const auto x = solve_upper(r, b);
    // Back substitution is backward stable (Higham, theorem 8.5).
    EXPECT_LE(distance(r * x, b), 8 * (size + 1) * kEpsilon * r.norm() * x.norm());
  }
}

// ---- Hermitian eigenproblems ----

void expect_hermitian_eigen(const QuaternionMatrixd& g) {
  const auto [values, vectors] = hermitian_eigen(g);
  const Eigen::Index size = g.rows();
  ASSERT_EQ(values.size(), size);
  ASSERT_TRUE(vectors.all_finite() && values.allFinite());
  // Householder reduction and tridiagonal QR: a small multiple of size * epsilon each.
  const double tolerance = 16 * static_cast<double>(size) * kEpsilon;
  EXPECT_LE(orthonormality_error(vectors), tolerance * std::sqrt(static_cast<double>(size)));
  EXPECT_LE(distance(vectors.scale_cols(values) * vectors.conjugate_transpose(), g),
            tolerance * g.norm());
  for (Eigen::Index k = 1; k < size; ++k) EXPECT_GE(values(k - 1), values(k));
}

QuaternionMatrixd random_hermitian(Eigen::Index size, std::mt19937& rng) {
  const auto m = random_matrix(size, size, rng);
  return m + m.conjugate_transpose();
}

TEST(HermitianEigen, RandomMatrices) {
  std::mt19937 rng(31);
  for (Eigen::Index size : {1, 2, 3, 4, 10, 33})
    expect_hermitian_eigen(random_hermitian(size, rng));
}

TEST(HermitianEigen, TwoByTwoInClosedForm) {
  // [[2, q], [conj q, -1]] with |q| = 2: eigenvalues 1/2 +- sqrt(9/4 + 4).
  QuaternionMatrixd g(2, 2);
  g.set(0, 0, Quaterniond(2.0));
  g.set(0, 1, {1, -1, 1, 1});
  g.set(1, 0, Quaterniond(1, -1, 1, 1).conj());
  g.set(1, 1, Quaterniond(-1.0));
  expect_hermitian_eigen(g);
  const auto values = hermitian_eigen(g).values;
  EXPECT_NEAR(values(0), 3, 16 * kEpsilon * 3);  // a handful of roundings
  EXPECT_NEAR(values(1), -2, 16 * kEpsilon * 3);
}

TEST(HermitianEigen, RepeatedEigenvalues) {
  auto twice = QuaternionMatrixd::identity(7);
  twice.a *= 2.0;
  expect_hermitian_eigen(twice);
  EXPECT_EQ(hermitian_eigen(twice).values, Eigen::VectorXd::Constant(7, 2.0));

  // Hidden behind a unitary, 3 3 3 -1 -1 0 0 0: odd columns of an adjoint would fail here.
  std::mt19937 rng(32);
  const auto q = random_unitary(8, rng);
  const Eigen::VectorXd expected{{3, 3, 3, 0, 0, 0, -1, -1}};
  const auto g = q.scale_cols(expected) * q.conjugate_transpose();
  expect_hermitian_eigen(g);
  // Weyl: eigenvalues move by no more than the error in g and in the decomposition.
  EXPECT_LE((hermitian_eigen(g).values - expected).norm(), 16 * 8 * kEpsilon * g.norm());
}

TEST(HermitianEigen, ZeroAndRankOne) {
  expect_hermitian_eigen(QuaternionMatrixd(1, 1));
  expect_hermitian_eigen(QuaternionMatrixd(5, 5));
  std::mt19937 rng(33);
  const auto x = random_matrix(9, 1, rng);
  const auto g = x * x.conjugate_transpose();
  expect_hermitian_eigen(g);
  const auto values = hermitian_eigen(g).values;
  const double tolerance = 16 * 9 * kEpsilon * g.norm();  // Weyl, as above
  EXPECT_NEAR(values(0), x.squared_norm(), tolerance);
  EXPECT_LE(values.tail(8).cwiseAbs().maxCoeff(), tolerance);
}

TEST(HermitianEigen, EmptyMatrix) {
  const auto eigen = hermitian_eigen(QuaternionMatrixd(0, 0));
  EXPECT_EQ(eigen.values.size(), 0);
  EXPECT_EQ(eigen.vectors.rows(), 0);
}

}  // namespace
}  // namespace qdmd::test
