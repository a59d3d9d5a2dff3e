// SPDX-License-Identifier: LGPL-2.1-or-later
// The eigenvalue of a Hessenberg pencil nearest to one, against the whole spectrum.
#include "core/quaternion/pencil.h"

#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

using Values = std::vector<std::complex<double>>;
using Column = std::vector<Quaterniond>;

QuaternionMatrixd to_matrix(const Column& column) {
  QuaternionMatrixd m(static_cast<Eigen::Index>(column.size()), 1);
  for (Eigen::Index k = 0; k < m.rows(); ++k) m.set(k, 0, column[static_cast<size_t>(k)]);
  return m;
}

QuaternionMatrixd times(QuaternionMatrixd column, const Quaterniond& q) {
  column.scale_col(0, q);
  return column;
}

// H v = B v lambda.
struct Problem {
  QuaternionMatrixd h, b;
  Eigen::Index size() const { return h.rows(); }
};

// B is the R of a random tall matrix: well conditioned, as that of noisy frames.
QuaternionMatrixd random_r(Eigen::Index size, std::mt19937& rng) {
  return qr(random_matrix(2 * size, size, rng), false).r;
}

// A Hessenberg matrix that is unitarily similar to `a`, times B. Its eigenvalues are those of `a`:
// (H B^-1) (B v) = (B v) lambda.
Problem problem_with(QuaternionMatrixd a, QuaternionMatrixd b) {
  reduce_to_hessenberg(a);
  return {a * b, std::move(b)};
}

// Normal and so perfectly conditioned, or similar to that by a random triangular matrix.
QuaternionMatrixd matrix_with(const Values& values, bool normal, std::mt19937& rng) {
  const auto size = static_cast<Eigen::Index>(values.size());
  auto a = diagonal(Eigen::Map<const Eigen::VectorXcd>(values.data(), size));
  if (!normal) {
    const auto off = random_matrix(size, size, rng);
    for (Eigen::Index c = 1; c < size; ++c)
      for (Eigen::Index r = 0; r < c; ++r) a.set(r, c, off.get(r, c) * 0.1);
  }
  const auto q = random_unitary(size, rng);
  return q * a * q.conjugate_transpose();
}

double omega(const std::complex<double>& value) { return omega_magnitude(value); }

// v is an eigenvector to working accuracy: backward stable whatever the conditioning is. Arnoldi
// stops at 16 epsilon of the operator's eigenvalue, whose norm may be some times that.
void expect_right_pair(const Problem& p, const PencilEigenpair<double>& pair) {
  const auto v = to_matrix(pair.vector);
  ASSERT_TRUE(v.all_finite());
  EXPECT_NEAR(v.norm(), 1, 64 * static_cast<double>(p.size()) * kEpsilon);
  EXPECT_GE(pair.value.imag(), 0);
  const double scale = p.h.norm() + std::abs(pair.value) * p.b.norm();
  EXPECT_LE(distance(p.h * v, times(p.b * v, Quaterniond(pair.value))),
            64 * static_cast<double>(p.size()) * kEpsilon * scale);
}

// u^H H = lambda' u^H B, with lambda' in the class of `value` up to `tolerance`.
void expect_left_vector(const Problem& p, const Pencil<double>& pencil,
                        const std::complex<double>& value, double tolerance) {
  const auto left = pencil.left_vector(value);
  ASSERT_TRUE(left.has_value());
  const auto u_h = to_matrix(*left).conjugate_transpose();
  EXPECT_NEAR(u_h.norm(), 1, 64 * static_cast<double>(p.size()) * kEpsilon);
  const auto uh = u_h * p.h, ub = u_h * p.b;
  const auto share = uh * ub.conjugate_transpose();
  const Quaterniond lambda = share.get(0, 0) * (1 / ub.squared_norm());
  auto expected = ub;
  expected.scale_row(0, lambda);
  EXPECT_LE(distance(uh, expected), 256 * static_cast<double>(p.size()) * kEpsilon *
                                        (p.h.norm() + std::abs(value) * p.b.norm()));
  EXPECT_LE(std::abs(std::complex(lambda.w, lambda.vector_norm()) - value), tolerance);
}

double distance_to(const Values& values, const std::complex<double>& value) {
  double nearest = kInfinity;
  for (const auto& v : values) nearest = std::min(nearest, std::abs(v - value));
  return nearest;
}

// The answer, if there is one, is a member of `spectrum`, and none is nearer to the origin.
// `tolerance` is what rounding moves eigenvalues by.
std::optional<PencilEigenpair<double>> expect_nearest_if_any(const Problem& p,
                                                             const Values& spectrum,
                                                             double tolerance) {
  const auto pair = Pencil<double>(p.h, p.b).nearest();
  if (!pair) return pair;
  expect_right_pair(p, *pair);
  EXPECT_LE(distance_to(spectrum, pair->value), tolerance) << pair->value;
  double smallest = kInfinity;
  for (const auto& value : spectrum) smallest = std::min(smallest, omega(value));
  // |d ln lambda| = |d lambda| / |lambda|.
  EXPECT_LE(omega(pair->value), smallest + 2 * tolerance / std::abs(pair->value)) << pair->value;
  return pair;
}

void expect_nearest(const Problem& p, const Values& spectrum, double tolerance) {
  const auto pair = expect_nearest_if_any(p, spectrum, tolerance);
  ASSERT_TRUE(pair.has_value());
  expect_left_vector(p, Pencil<double>(p.h, p.b), pair->value, tolerance);
}

Values spectrum_of(const Problem& p) {
  // H B^-1 and B^-1 H have the same eigenvalues.
  const auto form = schur(solve_upper(p.b, p.h));
  EXPECT_TRUE(form.converged);
  const Eigen::VectorXcd values = form.eigenvalues();
  return {values.data(), values.data() + values.size()};
}

// ---- Random pencils ----

TEST(Pencil, RandomPencilsOfEverySize) {
  std::mt19937 rng(161);
  for (int size = 1; size <= 60; ++size) {
    SCOPED_TRACE(size);
    auto h = random_matrix(size, size, rng);
    for (int c = 0; c < size; ++c)
      for (int r = c + 2; r < size; ++r) h.set(r, c, Quaterniond());
    const Problem p{h, random_r(size, rng)};
    // Condition numbers of random eigenvalues and of B, at most some hundred each.
    expect_nearest(p, spectrum_of(p), 1e-9);
  }
}

TEST(Pencil, WindowsOfNoiseOfEverySize) {
  std::mt19937 rng(162);
  for (size_t count : {2u, 3u, 4u, 5u, 6u, 10u, 17u, 30u, 50u, 61u}) {
    SCOPED_TRACE(count);
    const auto m = static_cast<Eigen::Index>(count);
    const auto r = qr(to_quaternions(noisy_clip(300, count, 5, rng)), false).r;
    const Problem p{r.block(0, 1, m - 1, m - 1), r.block(0, 0, m - 1, m - 1)};
    // The first column of B is a hundred times longer than the last pivot: that comes on top.
    expect_nearest(p, spectrum_of(p), 1e-8);
  }
}

// ---- Which eigenvalue is the nearest ----

TEST(Pencil, MeasuresLogarithmsAndNotDistances) {
  std::mt19937 rng(163);
  const std::complex<double> i(0, 1);
  struct Case {
    std::complex<double> chosen, decoy;  // the decoy is nearer to 1, but not in logarithm
  };
  const Case cases[] = {{1.6, 0.5},
                        {1.3, 0.75},
                        {1.012, 0.9881},
                        {1.65 + 0.0 * i, 0.5 + 0.38 * i},
                        {1.5 * std::exp(0.3 * i), 0.55},
                        {2.5, 0.2 * i}};
  for (const auto& [chosen, decoy] : cases) {
    ASSERT_LT(std::abs(decoy - 1.0), std::abs(chosen - 1.0));
    ASSERT_LT(omega(chosen), omega(decoy));
    for (int size : {2, 3, 8, 40})
      for (bool normal : {true, false}) {
        SCOPED_TRACE(size);
        Values values = {decoy, chosen};
        // The rest is far enough for the two to settle early.
        while (values.size() < static_cast<size_t>(size))
          values.push_back(std::polar(5.0 + static_cast<double>(values.size()) / 10,
                                      static_cast<double>(values.size())));
        for (auto& v : values) v = {v.real(), std::abs(v.imag())};
        const auto p = problem_with(matrix_with(values, normal, rng), random_r(size, rng));
        expect_nearest(p, values, 1e-10);
        const auto pair = Pencil<double>(p.h, p.b).nearest();
        ASSERT_TRUE(pair.has_value());
        EXPECT_LE(std::abs(pair->value - chosen), 1e-10);
      }
  }
}

TEST(Pencil, ZeroEigenvaluesAreInfinitelyFar) {
  std::mt19937 rng(164);
  for (int size : {2, 5, 20}) {
    Values values(static_cast<size_t>(size), 0.0);
    values[1] = {-4, 3};
    expect_nearest(problem_with(matrix_with(values, true, rng), random_r(size, rng)), values,
                   1e-10);
  }
}

TEST(Pencil, ExactlyOne) {
  std::mt19937 rng(165);
  for (int size : {1, 2, 3, 12, 40})
    for (int repeats : {1, 2, 5}) {
      if (repeats > size) continue;
      SCOPED_TRACE(std::to_string(size) + ", repeats " + std::to_string(repeats));
      Values values(static_cast<size_t>(repeats), 1.0);
      std::uniform_real_distribution<double> radius(0.2, 2), angle(0.1, M_PI);
      while (values.size() < static_cast<size_t>(size))
        values.push_back(std::polar(radius(rng), angle(rng)));
      expect_nearest(problem_with(matrix_with(values, true, rng), random_r(size, rng)), values,
                     1e-10);
      // The identity times one: H - B is exactly zero.
      const auto b = random_r(size, rng);
      expect_nearest({b, b}, {1.0}, 1e-10);
    }
}

TEST(Pencil, ClassesOfConjugates) {
  // One class comes several times, and so does its conjugate: i, -j and k are one eigenvalue.
  std::mt19937 rng(166);
  const Quaterniond units[] = {{0, 1, 0, 0}, {0, 0, -1, 0}, {0, 0, 0, 1}, {0, 0.6, -0.8, 0}};
  for (double angle : {0.01, 0.5, 3.0})
    for (int size : {1, 2, 4, 9}) {
      QuaternionMatrixd d(size, size);
      for (int k = 0; k < size; ++k)
        d.set(k, k, Quaterniond(std::cos(angle)) + units[k % 4] * std::sin(angle));
      const auto q = random_unitary(size, rng);
      expect_nearest(problem_with(q * d * q.conjugate_transpose(), random_r(size, rng)),
                     {std::polar(1.0, angle)}, 1e-10);
    }
}

TEST(Pencil, TwoClassesAtTheSameDistance) {
  // e^(i a) and e^a are equally far: either is right.
  std::mt19937 rng(167);
  const Values values = {std::polar(1.0, 0.25), std::exp(0.25), std::exp(-0.25), 3.0, -1.0};
  for (int repeat = 0; repeat < 10; ++repeat)
    expect_nearest(problem_with(matrix_with(values, repeat % 2, rng), random_r(5, rng)), values,
                   1e-10);
}

// ---- Hard pencils ----

TEST(Pencil, JordanBlockAtOne) {
  std::mt19937 rng(168);
  for (int block : {2, 3, 4})
    for (int size : {block, block + 5}) {
      QuaternionMatrixd a(size, size);
      Values values;
      for (int k = 0; k < size; ++k) {
        values.push_back(k < block ? 1.0 : 3.0 + k);
        a.set(k, k, Quaterniond(values.back().real()));
        if (k > 0 && k < block) a.set(k - 1, k, {0, 0, 1, 0});
      }
      const auto q = random_unitary(size, rng);
      const auto p = problem_with(q * a * q.conjugate_transpose(), random_r(size, rng));
      // A block of size s turns a perturbation into its s-th root.
      expect_nearest_if_any(p, values, 4 * std::pow(1e3 * size * kEpsilon, 1.0 / block));
    }
}

TEST(Pencil, NearlySingularB) {
  std::mt19937 rng(169);
  for (double pivot : {1e-6, 1e-10, 1e-14})
    for (int where : {0, 4, 9}) {
      auto b = random_r(10, rng);
      b.scale_row(where, Quaterniond(pivot));
      Problem p{random_matrix(10, 10, rng), b};
      for (int c = 0; c < 10; ++c)
        for (int r = c + 2; r < 10; ++r) p.h.set(r, c, Quaterniond());
      const Pencil<double> pencil(p.h, p.b);
      const auto pair = pencil.nearest();
      ASSERT_TRUE(pair.has_value());
      expect_right_pair(p, *pair);
      // In more digits, where the pivot is no obstacle.
      const auto widen = [](const QuaternionMatrixd& m) {
        const auto cast = [](const std::complex<double>& c) {
          return std::complex<long double>(c.real(), c.imag());
        };
        return QuaternionMatrix<long double>(m.a.unaryExpr(cast), m.b.unaryExpr(cast));
      };
      const auto form = schur(solve_upper(widen(p.b), widen(p.h)));
      ASSERT_TRUE(form.converged);
      double smallest = kInfinity;
      for (int k = 0; k < 10; ++k)
        smallest = std::min(
            smallest, static_cast<double>(omega_magnitude<long double>(form.eigenvalues()(k))));
      // Long double loses 1 / pivot of its 1e-19, the pencil nothing.
      EXPECT_NEAR(omega(pair->value), smallest, 1e-9 + 1e-17 / pivot);
    }
}

TEST(Pencil, ZeroPencilHasNoAnswer) {
  const auto zero = QuaternionMatrixd(4, 4);
  EXPECT_FALSE(Pencil<double>(zero, zero).nearest().has_value());
  // All eigenvalues zero: none is nearer than the others.
  const auto pair = Pencil<double>(zero, QuaternionMatrixd::identity(4)).nearest();
  if (pair) {
    EXPECT_LE(std::abs(pair->value), 64 * kEpsilon);
  }
}

TEST(Pencil, CrowdsAreRightOrRefused) {
  std::mt19937 rng(170);
  int refused = 0;
  for (int size : {30, 59, 60, 61, 90, 130})
    for (double radius : {1e-8, 1e-3, 0.3, 0.9}) {
      SCOPED_TRACE(std::to_string(size) + ", radius " + std::to_string(radius));
      // A circle around 1: the operator's eigenvalues all have the same size.
      Values values;
      for (int k = 0; k < size; ++k) {
        const auto v = 1.0 + std::polar(radius, M_PI * (k + 0.5) / size);
        values.emplace_back(v.real(), std::abs(v.imag()));
      }
      const auto p = problem_with(matrix_with(values, true, rng), random_r(size, rng));
      if (!expect_nearest_if_any(p, values, 1e-10)) ++refused;
    }
  EXPECT_GT(refused, 0) << "a crowd of 130 takes more steps than there are";
}

TEST(Pencil, CrowdsInARow) {
  // Real eigenvalues on either side of 1, more of them than steps, with or without one inside.
  std::mt19937 rng(171);
  for (int size : {20, 70, 100})
    for (double gap : {1e-10, 1e-4, 0.05})
      for (bool inside : {false, true}) {
        Values values;
        for (int k = 0; k < size; ++k)
          values.push_back(1 + gap * (1 + 0.01 * (k / 2)) * (k % 2 ? 1 : -1));
        if (inside) values[0] = 1 + gap / 10;
        const auto p = problem_with(matrix_with(values, true, rng), random_r(size, rng));
        expect_nearest_if_any(p, values, 1e-12);
      }
}

TEST(Arnoldi, SpansTheSpaceAndStops) {
  std::mt19937 rng(172);
  for (int size : {1, 2, 6, 20}) {
    const auto a = random_matrix(size, size, rng);
    const ScalarGrid<double> grid(a);
    const auto apply = [&](const Column& x) {
      Column y(x.size());
      for (Eigen::Index r = 0; r < size; ++r)
        for (Eigen::Index c = 0; c < size; ++c)
          y[static_cast<size_t>(r)] += grid(r, c) * x[static_cast<size_t>(c)];
      return y;
    };
    Arnoldi<double, decltype(apply)> space(apply, size);
    while (!space.complete()) ASSERT_TRUE(space.step());
    EXPECT_EQ(space.dimension(), size);
    const auto ritz = space.ritz();
    ASSERT_TRUE(ritz.converged);
    for (int k = 0; k < size; ++k) {
      const auto v = to_matrix(space.combine(ritz.coordinates[static_cast<size_t>(k)]));
      // Twice orthogonalized, then the Schur form's 50 m epsilon.
      EXPECT_LE(distance(a * v, times(v, Quaterniond(ritz.values[static_cast<size_t>(k)]))),
                100 * size * kEpsilon * a.norm());
      EXPECT_EQ(ritz.residuals[static_cast<size_t>(k)], 0);
      if (k > 0) {
        EXPECT_GE(std::abs(ritz.values[static_cast<size_t>(k - 1)]),
                  std::abs(ritz.values[static_cast<size_t>(k)]));
      }
    }
  }
}

TEST(Arnoldi, NoticesAnInvariantSpaceAndBadOperators) {
  const auto identity = [](const Column& x) { return x; };
  Arnoldi<double, decltype(identity)> invariant(identity, 12);
  ASSERT_TRUE(invariant.step());
  EXPECT_TRUE(invariant.complete()) << "one direction is all there is";
  const auto broken = [](const Column& x) { return Column(x.size(), Quaterniond(kInfinity)); };
  Arnoldi<double, decltype(broken)> infinite(broken, 3);
  EXPECT_FALSE(infinite.step());
  const auto zero = [](const Column& x) { return Column(x.size()); };
  Arnoldi<double, decltype(zero)> nothing(zero, 3);
  ASSERT_TRUE(nothing.step());
  EXPECT_TRUE(nothing.complete());
  EXPECT_EQ(nothing.ritz().values[0], 0.0);
}

}  // namespace
}  // namespace qdmd::test
