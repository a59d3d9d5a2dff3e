// SPDX-License-Identifier: LGPL-2.1-or-later
// QR and Cholesky factorizations of quaternion matrices, and triangular solves.
#pragma once

#include "core/quaternion/hessenberg.h"

namespace qdmd {

// M = Q R: q is rows x k with orthonormal columns, r is k x cols upper triangular with a real
// non-negative diagonal, k = min(rows, cols).
template <typename Real>
struct QrFactors {
  QuaternionMatrix<Real> q, r;
};

// Householder QR. `with_q` false leaves q empty and saves its cost.
template <typename Real>
QrFactors<Real> qr(QuaternionMatrix<Real> m, bool with_q = true) {
  using Index = Eigen::Index;
  const Index rows = m.rows(), cols = m.cols(), k = std::min(rows, cols);
  std::vector<Reflector<Real>> reflectors;
  reflectors.reserve(static_cast<size_t>(k));
  for (Index i = 0; i < k; ++i) {
    reflectors.push_back(make_reflector(m.block(i, i, rows - i, 1)));
    const auto& h = reflectors.back();
    apply_left(h, m, i, i + 1, cols - i - 1);
    m.a.col(i).tail(rows - i).setZero();
    m.b.col(i).tail(rows - i).setZero();
    m.set(i, i, h.alpha);
  }
  QrFactors<Real> factors;
  factors.r = m.block(0, 0, k, cols);
  if (with_q) {
    factors.q = QuaternionMatrix<Real>(rows, k);
    for (Index i = 0; i < k; ++i) factors.q.a(i, i) = std::complex<Real>(Real(1));
    for (Index i = k; i-- > 0;) apply_left(reflectors[static_cast<size_t>(i)], factors.q, i, 0, k);
  }
  for (Index i = 0; i < k; ++i) {
    const Quaternion<Real> phase = factors.r.get(i, i).unit();
    factors.r.scale_row(i, phase.conj());
    factors.r.set(i, i, Quaternion<Real>(factors.r.get(i, i).w));
    if (with_q) factors.q.scale_col(i, phase);
  }
  return factors;
}

// G = R^H R for Hermitian positive semidefinite G (size x size; only its lower triangle is read).
template <typename Real>
struct Cholesky {
  // pivots x size. Upper trapezoidal with a real positive diagonal when taken in order.
  QuaternionMatrix<Real> r;
  // How many squared pivots on R's diagonal were above the tolerance before one was not.
  Eigen::Index pivots = 0;

  bool complete() const { return pivots == r.cols(); }
};

namespace internal {

// lower(row.., col) minus lower(row.., from .. to - 1) times lower(pivot, from .. to - 1)^H.
template <typename Real>
void subtract_products(QuaternionMatrix<Real>& lower, Eigen::Index row, Eigen::Index pivot,
                       Eigen::Index col, Eigen::Index from, Eigen::Index to) {
  if (from == to) return;
  const Eigen::Index rows = lower.rows() - row, count = to - from;
  const auto pa = lower.a.block(row, from, rows, count), pb = lower.b.block(row, from, rows, count);
  // (a + b j)^H = conj(a) - b j for a scalar.
  const auto qa = lower.a.row(pivot).segment(from, count).transpose().eval();
  const auto qb = lower.b.row(pivot).segment(from, count).transpose().eval();
  auto a = lower.a.col(col).tail(rows), b = lower.b.col(col).tail(rows);
  a.noalias() -= pa * qa.conjugate();
  a.noalias() -= pb * qb.conjugate();
  b.noalias() += pa * qb;
  b.noalias() -= pb * qa;
}

}  // namespace internal

// Factorizes in order and stops at the first squared pivot that is not above `tolerance` times the
// largest diagonal element of G: what is left of G is then zero to working accuracy, or wants
// pivoting. R^H R equals G in its first `pivots` rows and columns.
template <typename Real>
Cholesky<Real> cholesky(const QuaternionMatrix<Real>& g, Real tolerance) {
  using Index = Eigen::Index;
  using std::sqrt;
  // Columns that are updated together by matrix products.
  constexpr Index kPanel = 24;
  const Index size = g.rows();
  Cholesky<Real> factor;
  QuaternionMatrix<Real> lower = g;
  const Real scale = size > 0 ? Real(g.a.diagonal().real().maxCoeff()) : Real(0);
  for (Index start = 0; start < size && factor.pivots == start; start += kPanel) {
    const Index end = std::min(start + kPanel, size);
    for (Index j = start; j < end; ++j) {
      internal::subtract_products(lower, j, j, j, start, j);
      const Real squared_pivot = lower.a(j, j).real();
      if (!(squared_pivot > tolerance * scale)) break;
      const Real pivot = sqrt(squared_pivot);
      lower.a.col(j).tail(size - j) *= Real(1) / pivot;
      lower.b.col(j).tail(size - j) *= Real(1) / pivot;
      lower.set(j, j, Quaternion<Real>(pivot));
      ++factor.pivots;
    }
    if (factor.pivots < end) break;
    // The rest of the lower triangle, a block of columns at a time.
    const Index width = end - start;
    for (Index col = end; col < size; col += kPanel) {
      const Index cols = std::min(kPanel, size - col), rows = size - col;
      const auto pa = lower.a.block(col, start, rows, width);
      const auto pb = lower.b.block(col, start, rows, width);
      const auto qa = lower.a.block(col, start, cols, width).eval();
      const auto qb = lower.b.block(col, start, cols, width).eval();
      auto a = lower.a.block(col, col, rows, cols), b = lower.b.block(col, col, rows, cols);
      a.noalias() -= pa * qa.adjoint();
      a.noalias() -= pb * qb.adjoint();
      b.noalias() += pa * qb.transpose();
      b.noalias() -= pb * qa.transpose();
    }
  }
  for (Index j = 0; j < factor.pivots; ++j) {
    lower.a.col(j).head(j).setZero();
    lower.b.col(j).head(j).setZero();
  }
  factor.r = lower.left_cols(factor.pivots).conjugate_transpose();
  return factor;
}

// Cholesky with the largest pivot that is left taken first, so that a G of any rank is factorized
// (all of G is read). R keeps the order of G's columns, is not triangular then, and has as many
// rows as there are squared pivots above the tolerance. Costs size * pivots^2: cheap for a low
// rank.
template <typename Real>
Cholesky<Real> pivoted_cholesky(const QuaternionMatrix<Real>& g, Real tolerance) {
  using Index = Eigen::Index;
  using std::sqrt;
  const Index size = g.rows();
  Cholesky<Real> factor;
  QuaternionMatrix<Real> lower(size, 0);
  std::vector<Index> order;
  Eigen::Matrix<Real, Eigen::Dynamic, 1> left = g.a.diagonal().real();
  const Real scale = size > 0 ? Real(left.maxCoeff()) : Real(0);
  while (factor.pivots < size) {
    Index pivot = 0;
    const Real squared_pivot = left.maxCoeff(&pivot);
    if (!(squared_pivot > tolerance * scale)) break;
    const Index k = factor.pivots++;
    if (k == lower.cols()) {
      const Index room = std::min(size, 2 * k + 8);
      lower.a.conservativeResize(size, room);
      lower.b.conservativeResize(size, room);
    }
    lower.a.col(k) = g.a.col(pivot);
    lower.b.col(k) = g.b.col(pivot);
    internal::subtract_products(lower, 0, pivot, k, 0, k);
    const Real root = sqrt(squared_pivot);
    lower.a.col(k) *= Real(1) / root;
    lower.b.col(k) *= Real(1) / root;
    // What rounding left in the rows that are done.
    for (Index row : order) lower.set(row, k, Quaternion<Real>());
    order.push_back(pivot);
    lower.set(pivot, k, Quaternion<Real>(root));
    left -= lower.a.col(k).cwiseAbs2() + lower.b.col(k).cwiseAbs2();
    for (Index row : order) left(row) = Real(0);
  }
  factor.r = lower.left_cols(factor.pivots).conjugate_transpose();
  return factor;
}

// X with R X = B, R upper triangular (size x size) with non-zero diagonal.
template <typename Real>
QuaternionMatrix<Real> solve_upper(const QuaternionMatrix<Real>& r, QuaternionMatrix<Real> b) {
  for (Eigen::Index i = r.rows(); i-- > 0;) {
    const Quaternion<Real> pivot = r.get(i, i);
    b.scale_row(i, pivot.conj() * (Real(1) / pivot.squared_norm()));
    if (i == 0) break;
    const auto update = r.block(0, i, i, 1) * b.block(i, 0, 1, b.cols());
    b.a.topRows(i) -= update.a;
    b.b.topRows(i) -= update.b;
  }
  return b;
}

// Estimate of the largest over the smallest singular value of an upper triangular matrix with a
// non-zero diagonal, by power iteration both ways: never too large, and seldom less than half of
// the truth. Infinite where the smallest one underflows.
template <typename Real>
Real condition_estimate(const ScalarGrid<Real>& r) {
  using std::sqrt;
  constexpr int kSteps = 6;
  const auto size = static_cast<size_t>(r.cols());
  const auto normalize = [](std::vector<Quaternion<Real>>& x) {
    Real squared(0);
    for (const auto& q : x) squared += q.squared_norm();
    const Real length = sqrt(squared);
    for (auto& q : x) q = q * (Real(1) / length);
    return length;
  };
  // Signs and sizes vary, so that no singular vector is likely to be missed.
  std::vector<Quaternion<Real>> large(size), small(size);
  for (size_t k = 0; k < size; ++k)
    large[k] = small[k] =
        Quaternion<Real>(Real(1), Real(k % 2), Real(k % 3) - Real(1), Real(k % 5) - Real(2));
  normalize(large);
  normalize(small);
  Real growth(0), decay(0);
  for (int step = 0; step < kSteps; ++step) {
    large = multiply_upper_adjoint(r, multiply_upper(r, large));
    growth = normalize(large);
    solve_upper_adjoint_in_place(r, small);
    solve_upper_in_place(r, small);
    decay = normalize(small);
    // Entries overflowed, or a column became zero.
    if (!(growth > Real(0)) || !square_is_safe(decay)) return std::numeric_limits<Real>::infinity();
  }
  const Real squared = growth * decay;
  return squared <= std::numeric_limits<Real>::max() ? std::max(Real(sqrt(squared)), Real(1))
                                                     : std::numeric_limits<Real>::infinity();
}

// In double they are compiled once, in double.cpp.
extern template QrFactors<double> qr(QuaternionMatrixd, bool);
extern template Cholesky<double> cholesky(const QuaternionMatrixd&, double);
extern template Cholesky<double> pivoted_cholesky(const QuaternionMatrixd&, double);
extern template QuaternionMatrixd solve_upper(const QuaternionMatrixd&, QuaternionMatrixd);
extern template double condition_estimate(const ScalarGrid<double>&);

}  // namespace qdmd
