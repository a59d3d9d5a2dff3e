// SPDX-License-Identifier: LGPL-2.1-or-later
// Singular value decompositions of quaternion matrices.
#include "core/quaternion/svd.h"

#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// Two reflectors a column, each off by a small multiple of epsilon (Higham, lemma 19.3), then
// Eigen's bidiagonal SVD, which promises as much.
double svd_tolerance(const QuaternionMatrixd& m) {
  return 16 * static_cast<double>(std::max(m.rows(), m.cols())) * kEpsilon;
}

Svd<double> expect_svd(const QuaternionMatrixd& m) {
  const auto result = svd(m);
  const auto& [values, u, v] = result;
  const Eigen::Index k = std::min(m.rows(), m.cols());
  EXPECT_EQ(values.size(), k);
  EXPECT_EQ(u.rows(), m.rows());
  EXPECT_EQ(u.cols(), k);
  EXPECT_EQ(v.rows(), m.cols());
  EXPECT_EQ(v.cols(), k);
  EXPECT_TRUE(values.allFinite() && u.all_finite() && v.all_finite());
  if (::testing::Test::HasFailure()) return result;
  const double tolerance = svd_tolerance(m);
  EXPECT_LE(orthonormality_error(u), tolerance * std::sqrt(static_cast<double>(k)));
  EXPECT_LE(orthonormality_error(v), tolerance * std::sqrt(static_cast<double>(k)));
  EXPECT_LE(distance(u.scale_cols(values) * v.conjugate_transpose(), m), tolerance * m.norm());
  for (Eigen::Index i = 0; i < k; ++i) EXPECT_GE(values(i), i + 1 < k ? values(i + 1) : 0.0);
  return result;
}

// Expects exactly these singular values, up to rounding of the largest.
void expect_values(const QuaternionMatrixd& m, const Eigen::VectorXd& expected) {
  const auto values = expect_svd(m).values;
  ASSERT_EQ(values.size(), expected.size());
  // Weyl: no singular value moves by more than the backward error, which is relative to |M|.
  EXPECT_LE((values - expected).cwiseAbs().maxCoeff(), svd_tolerance(m) * m.norm())
      << values.transpose();
}

QuaternionMatrixd with_values(const Eigen::VectorXd& values, Eigen::Index rows, Eigen::Index cols,
                              std::mt19937& rng) {
  const Eigen::Index k = values.size();
  return random_unitary(rows, rng).left_cols(k).scale_cols(values) *
         random_unitary(cols, rng).left_cols(k).conjugate_transpose();
}

// Below 16 columns Eigen's real SVD is Jacobi's, from there on divide and conquer.
constexpr std::pair<int, int> kShapes[] = {{1, 1},   {1, 7},   {7, 1},   {2, 2},   {3, 2},
                                           {2, 3},   {9, 9},   {16, 16}, {17, 17}, {33, 20},
                                           {20, 33}, {60, 60}, {300, 4}, {4, 300}, {120, 50}};

TEST(Svd, EveryShape) {
  std::mt19937 rng(101);
  for (const auto& [rows, cols] : kShapes) {
    SCOPED_TRACE(std::to_string(rows) + " x " + std::to_string(cols));
    const auto m = random_matrix(rows, cols, rng);
    expect_svd(m);
    const auto transposed = svd(m.conjugate_transpose()).values;
    EXPECT_LE((svd(m).values - transposed).norm(), svd_tolerance(m) * m.norm());
  }
}

TEST(Svd, NoColumnsOrNoRows) {
  for (const auto& [rows, cols] : {std::pair<int, int>{5, 0}, {0, 5}, {0, 0}}) {
    const auto [values, u, v] = svd(QuaternionMatrixd(rows, cols));
    EXPECT_EQ(values.size(), 0);
    EXPECT_EQ(u.rows(), rows);
    EXPECT_EQ(v.rows(), cols);
    EXPECT_EQ(u.cols() + v.cols(), 0);
  }
}

TEST(Svd, ValuesAreThoseOfTheComplexAdjoint) {
  std::mt19937 rng(102);
  for (const auto& [rows, cols] : kShapes) {
    const auto m = random_matrix(rows, cols, rng);
    const auto values = svd(m).values;
    const Eigen::JacobiSVD<Eigen::MatrixXcd> reference(m.adjoint());
    const double tolerance = 2 * svd_tolerance(m) * m.norm();  // both sides round
    for (Eigen::Index k = 0; k < values.size(); ++k)
      for (int twin : {0, 1})
        EXPECT_NEAR(values(k), reference.singularValues()(2 * k + twin), tolerance);
  }
}

TEST(Svd, OneByOneIsTheNormAndAPhase) {
  QuaternionMatrixd m(1, 1);
  m.set(0, 0, {1, -2, 2, -4});
  const auto [values, u, v] = expect_svd(m);
  EXPECT_NEAR(values(0), 5, 8 * kEpsilon * 5);  // a norm of four parts and a division
}

TEST(Svd, RankDeficient) {
  std::mt19937 rng(103);
  for (const auto& [rows, cols] : kShapes)
    for (int rank : {0, 1, 3}) {
      const Eigen::Index k = std::min(rows, cols);
      if (rank >= k) continue;
      const auto m = random_matrix(rows, rank, rng) * random_matrix(rank, cols, rng);
      const auto values = expect_svd(m).values;
      EXPECT_LE(values.tail(k - rank).maxCoeff(), svd_tolerance(m) * m.norm());
    }
}

TEST(Svd, ZeroColumnsAndEqualColumns) {
  std::mt19937 rng(104);
  for (int size : {6, 24}) {
    auto m = random_matrix(2 * size, size, rng);
    for (int c : {0, 2, 3}) {
      m.a.col(c).setZero();
      m.b.col(c).setZero();
    }
    for (int c : {4, 5}) {
      m.a.col(c) = m.a.col(1);
      m.b.col(c) = m.b.col(1);
    }
    const auto values = expect_svd(m).values;
    EXPECT_LE(values.tail(5).maxCoeff(), svd_tolerance(m) * m.norm());
    EXPECT_GT(values(size - 6), 0.01 * values(0));
    expect_svd(m.conjugate_transpose());
  }
}

TEST(Svd, ZeroMatrixAndIdentityAreExact) {
  for (int size : {1, 2, 15, 16, 17, 40}) {
    EXPECT_EQ(expect_svd(QuaternionMatrixd(size + 3, size)).values, Eigen::VectorXd::Zero(size));
    EXPECT_EQ(expect_svd(QuaternionMatrixd::identity(size)).values, Eigen::VectorXd::Ones(size));
  }
}

// ---- Repeated singular values: every second column of an adjoint would be the wrong choice ----

TEST(Svd, UnitaryMatrices) {
  std::mt19937 rng(105);
  for (int size : {1, 2, 3, 10, 16, 25, 60}) {
    auto u = random_unitary(size, rng);
    expect_values(u, Eigen::VectorXd::Ones(size));
    u.scale_col(0, Quaterniond(3.0));
    Eigen::VectorXd expected = Eigen::VectorXd::Ones(size);
    expected(0) = 3;
    expect_values(u, expected);
  }
}

TEST(Svd, PermutationsOfQuaternionUnits) {
  std::mt19937 rng(106);
  const Quaterniond units[] = {{1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, -1}};
  for (int size : {4, 9, 18, 40}) {
    std::vector<int> order(static_cast<size_t>(size));
    for (int k = 0; k < size; ++k) order[static_cast<size_t>(k)] = k;
    std::shuffle(order.begin(), order.end(), rng);
    QuaternionMatrixd m(size, size);
    for (int k = 0; k < size; ++k) m.set(order[static_cast<size_t>(k)], k, units[rng() % 4]);
    expect_values(m, Eigen::VectorXd::Ones(size));
  }
}

TEST(Svd, DisjointColumns) {
  // Spots that light up one after the other, all equally bright: M^H M is a multiple of I.
  for (int size : {2, 5, 20, 48}) {
    QuaternionMatrixd m(3 * size, size);
    for (int c = 0; c < size; ++c)
      for (int r = 0; r < 3; ++r) m.set(3 * c + r, c, {0, 10, 20, 20.0 * (r % 2 ? -1 : 1)});
    expect_values(m, Eigen::VectorXd::Constant(size, 30 * std::sqrt(3.0)));
  }
}

void expect_groups(int repeats, std::mt19937& rng) {
  Eigen::VectorXd expected(4 * repeats);
  for (int k = 0; k < 4 * repeats; ++k) expected(k) = std::array{5, 2, 1, 0}[k / repeats];
  expect_values(with_values(expected, 4 * repeats + 5, 4 * repeats, rng), expected);
}

TEST(Svd, GroupsOfRepeatedValues) {
  std::mt19937 rng(107);
  for (int repeats : {1, 2, 4})
    for (int trial = 0; trial < 10; ++trial) expect_groups(repeats, rng);
}

// Eigen 3.4's divide and conquer leaves |U S V^H - M| at up to 1e6 epsilon |M| in some percent of
// these, from about 32 columns on.
TEST(Svd, GroupsOfRepeatedValuesInLargeMatrices) {
  std::mt19937 rng(107);
  for (int repeats : {5, 9, 18})
    for (int trial = 0; trial < 40; ++trial) expect_groups(repeats, rng);
}

// ---- Wide ranges ----

TEST(Svd, GradedValuesAreGoodToEpsilonTimesTheLargest) {
  std::mt19937 rng(108);
  for (int size : {16, 46}) {
    Eigen::VectorXd expected(size);
    for (int k = 0; k < size; ++k) expected(k) = std::pow(10, -15.0 * k / (size - 1));
    for (const auto& [rows, cols] : {std::pair<int, int>{size, size}, {90, size}, {size, 90}})
      expect_values(with_values(expected, rows, cols, rng), expected);
  }
}

TEST(Svd, GradedRowsAndColumns) {
  std::mt19937 rng(109);
  for (bool rising : {false, true}) {
    auto m = random_matrix(30, 20, rng);
    for (int c = 0; c < 20; ++c)
      m.scale_col(c, Quaterniond(std::pow(10, -15.0 * (rising ? 19 - c : c) / 19)));
    expect_svd(m);
    expect_svd(m.conjugate_transpose());
  }
}

TEST(Svd, TwoScalesFarApart) {
  // A picture of 255 levels and a difference in one pixel's last bit.
  for (double small : {1e-8, 1e-15, 1e-300}) {
    QuaternionMatrixd m(4, 2);
    for (int c = 0; c < 2; ++c)
      for (int r = 0; r < 4; ++r) m.set(r, c, {0, 1, 1, 1});
    m.b(3, 1) += small;
    const auto values = expect_svd(m).values;
    EXPECT_NEAR(values(0), std::sqrt(24.0), 1e-7);
    EXPECT_LE(values(1), small + svd_tolerance(m) * m.norm());
  }
}

TEST(Svd, PowersOfTwoChangeNoBit) {
  std::mt19937 rng(110);
  for (int size : {5, 20}) {
    const auto m = random_matrix(size + 3, size, rng);
    const auto expected = svd(m);
    // Entries of about 2^1000 have squares that overflow, those of 2^-900 squares that vanish.
    for (int exponent : {-900, -500, 500, 1000}) {
      auto scaled = m;
      scaled.scale_by_power_of_two(exponent);
      const auto actual = svd(scaled);
      EXPECT_EQ(actual.values, expected.values * std::ldexp(1.0, exponent)) << exponent;
      EXPECT_EQ(distance(actual.u, expected.u), 0) << exponent;
      EXPECT_EQ(distance(actual.v, expected.v), 0) << exponent;
    }
  }
}

TEST(Svd, TinyAndHugeScales) {
  std::mt19937 rng(111);
  for (double scale : {1e-150, 1e150})
    for (int size : {3, 18}) {
      Eigen::VectorXd expected(size);
      for (int k = 0; k < size; ++k) expected(k) = (k % 2 ? 0.5 : 1.0) * scale;
      std::sort(expected.begin(), expected.end(), std::greater<>());
      const auto m = with_values(expected, 30, size, rng);
      const auto values = svd(m).values;
      // |M| in units of the scale is the square root of the size at most.
      EXPECT_LE((values - expected).cwiseAbs().maxCoeff() / scale,
                svd_tolerance(m) * std::sqrt(size));
    }
}

TEST(Svd, SubnormalEntries) {
  std::mt19937 rng(112);
  auto m = random_matrix(6, 4, rng);
  const auto expected = svd(m).values;
  m.scale_by_power_of_two(-1060);
  const auto [values, u, v] = svd(m);
  ASSERT_TRUE(values.allFinite() && u.all_finite() && v.all_finite());
  // Entries keep about 14 bits: each moves by half of the smallest number, |E| by 10 of them.
  const double smallest = std::numeric_limits<double>::denorm_min();
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(values(k), std::ldexp(expected(k), -1060), 16 * smallest);
  EXPECT_LE(orthonormality_error(u), svd_tolerance(m) * 2);
}

}  // namespace
}  // namespace qdmd::test
