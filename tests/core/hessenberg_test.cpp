// SPDX-License-Identifier: LGPL-2.1-or-later
// Hessenberg form, Hessenberg systems and triangular systems.
#include "core/quaternion/hessenberg.h"

#include <Eigen/QR>

#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

using Column = std::vector<Quaterniond>;

Column to_column(const QuaternionMatrixd& m) {
  Column column(static_cast<size_t>(m.rows()));
  for (Eigen::Index k = 0; k < m.rows(); ++k) column[static_cast<size_t>(k)] = m.get(k, 0);
  return column;
}
QuaternionMatrixd to_matrix(const Column& column) {
  QuaternionMatrixd m(static_cast<Eigen::Index>(column.size()), 1);
  for (Eigen::Index k = 0; k < m.rows(); ++k) m.set(k, 0, column[static_cast<size_t>(k)]);
  return m;
}
Column random_column(Eigen::Index size, std::mt19937& rng) {
  return to_column(random_matrix(size, 1, rng));
}

QuaternionMatrixd random_hessenberg(Eigen::Index rows, Eigen::Index cols, std::mt19937& rng) {
  auto m = random_matrix(rows, cols, rng);
  for (Eigen::Index c = 0; c < cols; ++c)
    for (Eigen::Index r = c + 2; r < rows; ++r) m.set(r, c, Quaterniond());
  return m;
}

// Sums of up to `size` quaternion products, a few of them one after the other.
double sum_tolerance(Eigen::Index size) { return 16 * static_cast<double>(size + 1) * kEpsilon; }

// ---- Hessenberg form ----

void expect_hessenberg_form(const QuaternionMatrixd& m) {
  auto h = m;
  const auto q = reduce_to_hessenberg(h);
  const Eigen::Index size = m.rows();
  ASSERT_EQ(q.rows(), size);
  for (Eigen::Index c = 0; c < size; ++c)
    for (Eigen::Index r = c + 2; r < size; ++r) ASSERT_EQ(h.get(r, c).norm(), 0);
  // One reflector a column, off by a small multiple of epsilon (Higham, lemma 19.3).
  const double tolerance = sum_tolerance(size);
  EXPECT_LE(orthonormality_error(q), tolerance * std::sqrt(static_cast<double>(size)));
  EXPECT_LE(distance(q * h * q.conjugate_transpose(), m), tolerance * m.norm());
  // Reflectors leave the first axis alone.
  if (size > 0) {
    EXPECT_EQ(distance(q.col(0), QuaternionMatrixd::identity(size).col(0)), 0);
  }
}

TEST(ReduceToHessenberg, RandomMatrices) {
  std::mt19937 rng(141);
  for (Eigen::Index size : {0, 1, 2, 3, 4, 7, 20, 61})
    expect_hessenberg_form(random_matrix(size, size, rng));
}

TEST(ReduceToHessenberg, LeavesHessenbergInputAlone) {
  std::mt19937 rng(142);
  for (Eigen::Index size : {1, 2, 3, 15}) {
    const auto before = random_hessenberg(size, size, rng);
    auto h = before;
    const auto q = reduce_to_hessenberg(h);
    EXPECT_EQ(distance(h, before), 0);
    EXPECT_EQ(distance(q, QuaternionMatrixd::identity(size)), 0);
  }
}

TEST(ReduceToHessenberg, ZerosInOddPlaces) {
  std::mt19937 rng(143);
  expect_hessenberg_form(QuaternionMatrixd(6, 6));
  auto m = random_matrix(8, 8, rng);
  for (int r = 0; r < 8; ++r) m.set(r, 2, Quaterniond());  // a column of zeros
  for (int r = 1; r < 7; ++r) m.set(r, 0, Quaterniond());  // the last entry alone is left
  for (int c = 0; c < 8; ++c) m.set(3, c, Quaterniond());  // a row of zeros
  expect_hessenberg_form(m);
  expect_hessenberg_form(random_matrix(9, 1, rng) * random_matrix(1, 9, rng));
  // Lower triangular: every column has all that there is to reduce.
  auto lower = random_matrix(8, 8, rng);
  for (int c = 1; c < 8; ++c)
    for (int r = 0; r < c; ++r) lower.set(r, c, Quaterniond());
  expect_hessenberg_form(lower);
}

TEST(ReduceToHessenberg, GradedMatrix) {
  std::mt19937 rng(144);
  auto m = random_matrix(12, 12, rng);
  for (int k = 0; k < 12; ++k) {
    m.scale_row(k, Quaterniond(std::pow(10, -k)));
    m.scale_col(k, Quaterniond(std::pow(10, k % 3)));
  }
  expect_hessenberg_form(m);
}

// ---- Hessenberg systems ----

TEST(HessenbergQr, SolvesSquareSystemsAndTheirAdjoints) {
  std::mt19937 rng(145);
  for (Eigen::Index size : {1, 2, 3, 10, 40}) {
    const auto s = random_hessenberg(size, size, rng);
    const HessenbergQr<double> factors(s);
    const auto y = random_column(size, rng);
    const auto x = to_matrix(factors.solve(y)), z = to_matrix(factors.solve_adjoint(y));
    // Backward stable (Higham, theorem 19.5), so the condition number does not come in.
    const double tolerance = sum_tolerance(size) * s.norm();
    EXPECT_LE(distance(s * x, to_matrix(y)), tolerance * x.norm());
    EXPECT_LE(distance(s.conjugate_transpose() * z, to_matrix(y)), tolerance * z.norm());
  }
}

TEST(HessenbergQr, LeastSquaresWithOneMoreRow) {
  std::mt19937 rng(146);
  for (Eigen::Index cols : {1, 2, 5, 24}) {
    const auto s = random_hessenberg(cols + 1, cols, rng);
    const auto y = random_matrix(cols + 1, 1, rng);
    const auto x = to_matrix(HessenbergQr<double>(s).solve(to_column(y)));
    ASSERT_EQ(x.rows(), cols);
    // The residual is orthogonal to the columns: the gradient is zero up to rounding.
    const auto gradient = s.conjugate_transpose() * (s * x - y);
    EXPECT_LE(gradient.norm(), sum_tolerance(cols) * s.norm() * (s.norm() * x.norm() + y.norm()));
    Eigen::VectorXcd rhs(2 * (cols + 1));
    rhs << y.a, -y.b.conjugate();
    const Eigen::VectorXcd reference = s.adjoint().colPivHouseholderQr().solve(rhs);
    // A random Hessenberg matrix of this size has a condition number below 1e4; its square counts
    // where there is a residual.
    EXPECT_LE(distance(x, QuaternionMatrixd::from_adjoint_columns(reference)),
              1e8 * sum_tolerance(cols) * x.norm());
  }
}

TEST(HessenbergQr, ExactRightHandSideHasNoResidual) {
  std::mt19937 rng(147);
  const auto s = random_hessenberg(13, 12, rng);
  const auto expected = random_matrix(12, 1, rng);
  const auto x = to_matrix(HessenbergQr<double>(s).solve(to_column(s * expected)));
  EXPECT_LE(distance(s * x, s * expected), sum_tolerance(13) * s.norm() * expected.norm());
}

TEST(HessenbergQr, PivotsAreThoseOfAQr) {
  std::mt19937 rng(148);
  for (const auto& [rows, cols] : {std::pair<int, int>{1, 1}, {2, 1}, {6, 6}, {16, 15}}) {
    const auto s = random_hessenberg(rows, cols, rng);
    const auto r = qr(s, false).r;
    double smallest = kInfinity;
    for (int k = 0; k < cols; ++k) smallest = std::min(smallest, r.a(k, k).real());
    EXPECT_NEAR(HessenbergQr<double>(s).smallest_pivot(), smallest, sum_tolerance(rows) * s.norm());
  }
  EXPECT_EQ(HessenbergQr<double>(QuaternionMatrixd(4, 4)).smallest_pivot(), 0);
}

TEST(HessenbergQr, RaisedPivotsMakeSingularSystemsPointAtTheNullSpace) {
  std::mt19937 rng(149);
  const Eigen::Index size = 9;
  auto dependent = random_hessenberg(size, size, rng);
  // Column 5 is a combination of those before it, and is Hessenberg therefore.
  const auto combination = dependent.left_cols(5) * random_matrix(5, 1, rng);
  dependent.a.col(5) = combination.a;
  dependent.b.col(5) = combination.b;
  auto zero_column = random_hessenberg(size, size, rng);
  zero_column.a.col(3).setZero();
  zero_column.b.col(3).setZero();
  auto zero_row = random_hessenberg(size, size, rng);
  zero_row.a.row(size - 1).setZero();
  zero_row.b.row(size - 1).setZero();
  for (const auto& s : {dependent, zero_column, zero_row}) {
    HessenbergQr<double> factors(s);
    const double floor = kEpsilon * s.norm();
    factors.raise_pivots(floor);
    EXPECT_GE(factors.smallest_pivot(), floor * (1 - 4 * kEpsilon));
    const auto y = random_column(size, rng);
    for (bool adjoint : {false, true}) {
      const auto x = to_matrix(adjoint ? factors.solve_adjoint(y) : factors.solve(y));
      ASSERT_TRUE(x.all_finite());
      // One step of inverse iteration from a random start: |S x| / |x| is the floor, times what
      // the start lacks of the null vector and the factorization's own rounding.
      const auto image = adjoint ? s.conjugate_transpose() * x : s * x;
      EXPECT_LE(image.norm(), 1e3 * sum_tolerance(size) * s.norm() * x.norm());
      EXPECT_GE(x.norm(), 1e6 * to_matrix(y).norm()) << "large where there is no solution";
    }
  }
}

TEST(HessenbergQr, RaisesOnlyPivotsThatAreTooSmall) {
  std::mt19937 rng(150);
  const auto s = random_hessenberg(7, 7, rng);
  HessenbergQr<double> factors(s), raised(s);
  raised.raise_pivots(factors.smallest_pivot() / 2);
  const auto y = random_column(7, rng);
  EXPECT_EQ(distance(to_matrix(factors.solve(y)), to_matrix(raised.solve(y))), 0);
  QuaternionMatrixd zero(3, 3);
  HessenbergQr<double> of_zero(zero);
  of_zero.raise_pivots(2);
  EXPECT_EQ(of_zero.smallest_pivot(), 2);
}

// ---- Triangular systems ----

// Upper triangular, quaternion diagonal away from zero. The strict lower part is not a number: the
// helpers must not read it.
struct Upper {
  QuaternionMatrixd matrix;
  ScalarGrid<double> grid;
};
Upper random_upper(Eigen::Index size, std::mt19937& rng) {
  auto r = random_matrix(size, size, rng);
  for (Eigen::Index k = 0; k < size; ++k)
    r.set(k, k, r.get(k, k).unit() * std::sqrt(static_cast<double>(4 * size)));
  auto with_garbage = r;
  for (Eigen::Index c = 0; c < size; ++c)
    for (Eigen::Index k = c + 1; k < size; ++k) {
      r.set(k, c, Quaterniond());
      with_garbage.set(k, c, Quaterniond(std::nan("")));
    }
  return {r, ScalarGrid<double>(with_garbage)};
}

TEST(Triangular, MultipliesAndSolvesEitherWay) {
  std::mt19937 rng(151);
  for (Eigen::Index size : {0, 1, 2, 5, 30}) {
    const auto [r, grid] = random_upper(size, rng);
    const auto r_h = r.conjugate_transpose();
    const auto x = random_column(size, rng);
    const double tolerance = sum_tolerance(size) * r.norm();
    const double length = to_matrix(x).norm();
    EXPECT_LE(distance(to_matrix(multiply_upper(grid, x)), r * to_matrix(x)), tolerance * length);
    EXPECT_LE(distance(to_matrix(multiply_upper_adjoint(grid, x)), r_h * to_matrix(x)),
              tolerance * length);
    // Higham, theorem 8.5.
    auto solution = x;
    solve_upper_in_place(grid, solution);
    EXPECT_LE(distance(r * to_matrix(solution), to_matrix(x)),
              tolerance * to_matrix(solution).norm());
    solution = x;
    solve_upper_adjoint_in_place(grid, solution);
    EXPECT_LE(distance(r_h * to_matrix(solution), to_matrix(x)),
              tolerance * to_matrix(solution).norm());
  }
}

TEST(Triangular, ScalesOfTheDiagonalDoNotMatter) {
  std::mt19937 rng(152);
  // Graded rows from 1 to 1e-120 (squares have to stay in range): each solution is a diagonal
  // scaling of a harmless one.
  auto [r, grid] = random_upper(11, rng);
  auto graded = r;
  Column y = random_column(11, rng), scaled = y;
  for (int k = 0; k < 11; ++k) {
    const double scale = std::ldexp(1.0, -40 * k);
    graded.scale_row(k, Quaterniond(scale));
    scaled[static_cast<size_t>(k)] = scaled[static_cast<size_t>(k)] * scale;
  }
  solve_upper_in_place(ScalarGrid<double>(r), y);
  solve_upper_in_place(ScalarGrid<double>(graded), scaled);
  EXPECT_LE(distance(to_matrix(y), to_matrix(scaled)), sum_tolerance(11) * to_matrix(y).norm());
}

}  // namespace
}  // namespace qdmd::test
