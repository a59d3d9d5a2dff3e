// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/quaternion/schur.h"

#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

using Values = std::vector<std::complex<double>>;

Values to_values(const Eigen::VectorXcd& v) { return {v.data(), v.data() + v.size()}; }

// The largest distance when every actual value is matched with the nearest expected one left.
double set_distance(const Values& actual, Values expected) {
  if (actual.size() != expected.size()) return kInfinity;
  double largest = 0;
  for (const auto& value : actual) {
    const auto nearest = std::min_element(
        expected.begin(), expected.end(),
        [&](const auto& l, const auto& r) { return std::abs(l - value) < std::abs(r - value); });
    largest = std::max(largest, std::abs(*nearest - value));
    expected.erase(nearest);
  }
  return largest;
}

// Each standard eigenvalue and its conjugate: the spectrum of the complex adjoint.
Values with_conjugates(const Eigen::VectorXcd& standard) {
  Values all = to_values(standard);
  for (const auto& value : to_values(standard)) all.push_back(std::conj(value));
  return all;
}

SchurForm<double> expect_schur(const QuaternionMatrixd& a) {
  const auto form = schur(a);
  EXPECT_TRUE(form.converged);
  if (!form.converged) return form;
  const Eigen::Index m = a.rows();
  // About three sweeps an eigenvalue, each a unitary step of relative error a few epsilon.
  const double tolerance = 50 * static_cast<double>(m) * kEpsilon;
  EXPECT_LE(distance(form.q * form.t * form.q.conjugate_transpose(), a), tolerance * a.norm());
  EXPECT_LE(orthonormality_error(form.q), tolerance);
  for (Eigen::Index c = 0; c < m; ++c) {
    for (Eigen::Index r = c + 1; r < m; ++r) EXPECT_EQ(form.t.get(r, c).norm(), 0);
    EXPECT_GE(form.t.a(c, c).imag(), 0);
    EXPECT_EQ(form.t.b(c, c), 0.0);
  }
  return form;
}

// Expects exactly these standard eigenvalues.
void expect_eigenvalues(const QuaternionMatrixd& a, const Values& expected, double tolerance) {
  const auto form = expect_schur(a);
  EXPECT_LE(set_distance(to_values(form.eigenvalues()), expected), tolerance)
      << form.eigenvalues().transpose();
}

TEST(Schur, RandomMatricesOfEverySize) {
  std::mt19937 rng(41);
  for (int m = 1; m <= 60; ++m) expect_schur(random_matrix(m, m, rng));
}

TEST(Schur, EigenvaluesAreThoseOfTheComplexAdjoint) {
  std::mt19937 rng(42);
  for (int m : {1, 2, 3, 4, 5, 8, 13, 21, 34, 47, 60}) {
    const auto a = random_matrix(m, m, rng);
    const auto form = expect_schur(a);
    const Eigen::ComplexEigenSolver<Eigen::MatrixXcd> reference(a.adjoint(), false);
    // Random eigenvalues have condition numbers up to some 100, both sides have 50 m eps |A|.
    EXPECT_LE(set_distance(with_conjugates(form.eigenvalues()), to_values(reference.eigenvalues())),
              1e-10 * a.norm() / m);
  }
}

TEST(Schur, DiagonalAndTriangularInput) {
  expect_eigenvalues(QuaternionMatrixd::identity(6), Values(6, 1.0), 0);
  expect_eigenvalues(QuaternionMatrixd(5, 5), Values(5, 0.0), 0);
  // The conjugate of i and a j part are in the class of i, exactly up to a rotation's rounding.
  auto units = QuaternionMatrixd::identity(4);
  units.set(1, 1, {0, -1, 0, 0});
  units.set(2, 2, {0, 0, 1, 0});
  units.set(3, 3, {0, 0, 0, -1});
  const std::complex<double> i(0, 1);
  expect_eigenvalues(units, {1.0, i, i, i}, 8 * kEpsilon);
}

TEST(Schur, RealRotationHasOneClassTwice) {
  // Both eigenvalues of [[0, -1], [1, 0]] are i as quaternions: no shift polynomial separates them.
  QuaternionMatrixd a(2, 2);
  a.a(0, 1) = -1;
  a.a(1, 0) = 1;
  const std::complex<double> i(0, 1);
  expect_eigenvalues(a, {i, i}, 100 * kEpsilon);  // 50 m eps, m = 2; normal, so no amplification
}

TEST(Schur, CyclicShifts) {
  // Unitary Hessenberg matrices, on which an unshifted QR step does nothing.
  for (int m : {2, 3, 4, 5, 6, 7, 8, 16, 31}) {
    QuaternionMatrixd a(m, m);
    for (int k = 0; k < m; ++k) a.a((k + 1) % m, k) = 1;
    Values roots;
    for (int k = 0; k < m; ++k) {
      const auto root = std::polar(1.0, 2 * M_PI * k / m);
      roots.emplace_back(root.real(), std::abs(root.imag()));
    }
    // Normal: eigenvalues move by the backward error, 50 m eps |A| with |A| = sqrt(m).
    expect_eigenvalues(a, roots, 50 * m * kEpsilon * std::sqrt(m));
  }
}

TEST(Schur, RandomPermutations) {
  std::mt19937 rng(43);
  for (int m : {3, 6, 10, 17}) {
    std::vector<int> order(static_cast<size_t>(m));
    for (int k = 0; k < m; ++k) order[static_cast<size_t>(k)] = k;
    for (int repeat = 0; repeat < 5; ++repeat) {
      std::shuffle(order.begin(), order.end(), rng);
      QuaternionMatrixd a(m, m);
      for (int k = 0; k < m; ++k) a.a(order[static_cast<size_t>(k)], k) = 1;
      const auto form = expect_schur(a);
      // Unitary: backward error 50 m eps |A| again.
      for (const auto& value : to_values(form.eigenvalues()))
        EXPECT_NEAR(std::abs(value), 1, 50 * m * kEpsilon * std::sqrt(m));
    }
  }
}

TEST(Schur, JordanBlocks) {
  std::mt19937 rng(44);
  for (int m : {2, 3, 5, 8}) {
    QuaternionMatrixd jordan(m, m);
    for (int k = 0; k < m; ++k) {
      jordan.set(k, k, {0.5, 0.25, 0, 0});
      if (k > 0) jordan.set(k - 1, k, {0, 0, 1, 0});
    }
    expect_eigenvalues(jordan, Values(static_cast<size_t>(m), {0.5, 0.25}), 8 * kEpsilon);
    const auto q = random_unitary(m, rng);
    const auto hidden = q * jordan * q.conjugate_transpose();
    // A block of size m amplifies a perturbation to its m-th root (times a constant near 1).
    expect_eigenvalues(hidden, Values(static_cast<size_t>(m), {0.5, 0.25}),
                       2 * std::pow(50 * m * kEpsilon, 1.0 / m));
  }
}

TEST(Schur, Nilpotent) {
  std::mt19937 rng(45);
  for (int m : {2, 4, 9, 20}) {
    auto strict = random_matrix(m, m, rng);
    for (int c = 0; c < m; ++c)
      for (int r = c; r < m; ++r) strict.set(r, c, Quaterniond());
    expect_eigenvalues(strict, Values(static_cast<size_t>(m), 0.0), 0);
    expect_schur(strict.conjugate_transpose());
    const auto q = random_unitary(m, rng);
    expect_schur(q * strict * q.conjugate_transpose());
  }
}

TEST(Schur, HermitianInputHasRealEigenvalues) {
  std::mt19937 rng(46);
  for (int m : {2, 5, 15}) {
    auto a = random_matrix(m, m, rng);
    a += a.conjugate_transpose();
    const auto form = expect_schur(a);
    // Normal: T is diagonal and real up to the backward error.
    const double tolerance = 50 * m * kEpsilon * a.norm();
    const Eigen::VectorXd real = form.eigenvalues().real();
    EXPECT_LE(distance(form.t, diagonal(real.cast<std::complex<double>>())), tolerance);
  }
}

TEST(Schur, CompanionMatrix) {
  // (x - 1)(x - 2)(x^2 + 1) = x^4 - 3 x^3 + 3 x^2 - 3 x + 2, first row -coefficients.
  QuaternionMatrixd a(4, 4);
  a.a.row(0) << 3, -3, 3, -2;
  for (int k = 1; k < 4; ++k) a.a(k, k - 1) = 1;
  const std::complex<double> i(0, 1);
  // Condition numbers of these roots stay below 20.
  expect_eigenvalues(a, {1.0, 2.0, i, i}, 20 * 50 * 4 * kEpsilon * a.norm());
}

TEST(Schur, ExactlyRepeatedEigenvalues) {
  std::mt19937 rng(47);
  const std::complex<double> c(0.6, 0.8);
  const Eigen::VectorXcd values{{c, c, c, 1.0, 1.0, -0.5, 0.0, 0.0}};
  for (int repeat = 0; repeat < 10; ++repeat) {
    const auto q = random_unitary(8, rng);
    const auto a = q * diagonal(values) * q.conjugate_transpose();
    // Normal: no amplification.
    expect_eigenvalues(a, to_values(values), 50 * 8 * kEpsilon * a.norm());
  }
}

TEST(Schur, WideRangeOfScales) {
  std::mt19937 rng(48);
  // Powers of 2 change no rounding unless something is compared with an absolute constant. Shifts
  // take the fourth power of an entry, which bounds the range at about 2^+-255.
  for (double scale : {std::ldexp(1.0, -200), std::ldexp(1.0, 200)}) {
    auto a = random_matrix(6, 6, rng);
    const auto expected = to_values(schur(a).eigenvalues());
    a.a *= scale;
    a.b *= scale;
    const auto form = schur(a);
    ASSERT_TRUE(form.converged);
    auto actual = to_values(form.eigenvalues());
    for (auto& value : actual) value /= scale;
    EXPECT_LE(set_distance(actual, expected), 100 * 50 * 6 * kEpsilon) << scale;
  }
}

TEST(Schur, GradedMatrix) {
  std::mt19937 rng(49);
  const int m = 10;
  auto a = random_matrix(m, m, rng);
  for (int k = 0; k < m; ++k) {
    a.scale_row(k, Quaterniond(std::pow(10, -k)));
    a.scale_col(k, Quaterniond(std::pow(10, -k)));
  }
  expect_schur(a);
}

TEST(TriangularEigenvector, IsARightEigenvectorOfTheMatrix) {
  std::mt19937 rng(50);
  for (int m : {1, 2, 3, 7, 20}) {
    const auto a = random_matrix(m, m, rng);
    const auto form = expect_schur(a);
    for (int k = 0; k < m; ++k) {
      const auto w = triangular_eigenvector(form.t, k);
      EXPECT_NEAR(w.norm(), 1, 4 * m * kEpsilon);
      for (int r = k + 1; r < m; ++r) EXPECT_EQ(w.get(r, 0).norm(), 0);
      const auto v = form.q * w;
      auto v_lambda = v;
      v_lambda.scale_col(0, Quaterniond(form.t.a(k, k)));
      // Back substitution has a small residual in T; the Schur form's own error comes on top.
      EXPECT_LE(distance(a * v, v_lambda), 2 * 50 * m * kEpsilon * a.norm());
    }
  }
}

TEST(TriangularEigenvector, OfRepeatedAndDefectiveEigenvalues) {
  std::mt19937 rng(51);
  for (const auto& superdiagonal : {Quaterniond(), Quaterniond{0, 0, 1, 0}}) {
    QuaternionMatrixd t(3, 3);
    for (int k = 0; k < 3; ++k) t.set(k, k, {0.5, 0.5, 0, 0});
    t.set(0, 1, superdiagonal);
    t.set(1, 2, superdiagonal);
    for (int k = 0; k < 3; ++k) {
      const auto w = triangular_eigenvector(t, k);
      ASSERT_TRUE(w.all_finite());
      auto w_lambda = w;
      w_lambda.scale_col(0, Quaterniond(t.a(k, k)));
      // Zero divisors become epsilon |T|: that is the residual they may leave.
      EXPECT_LE(distance(t * w, w_lambda), 4 * kEpsilon * t.norm());
    }
  }
  const auto zero = triangular_eigenvector(QuaternionMatrixd(3, 3), 2);
  EXPECT_TRUE(zero.all_finite());
  EXPECT_EQ(zero.norm(), 1);
}

}  // namespace
}  // namespace qdmd::test
