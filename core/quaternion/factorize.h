// QR and Cholesky factorizations of quaternion matrices, and triangular solves.
#pragma once

#include <optional>

#include "core/quaternion/householder.h"

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

// G = R^H R for Hermitian positive definite G (size x size; only its lower triangle is read).
// R is upper triangular with a real positive diagonal. Empty when a squared pivot is not above
// `tolerance` times the largest diagonal element of G: G is then singular to working accuracy.
template <typename Real>
std::optional<QuaternionMatrix<Real>> cholesky(const QuaternionMatrix<Real>& g, Real tolerance) {
  using Index = Eigen::Index;
  using std::sqrt;
  const Index size = g.rows();
  QuaternionMatrix<Real> lower(size, size);
  const Real scale = size > 0 ? Real(g.a.diagonal().real().maxCoeff()) : Real(0);
  for (Index j = 0; j < size; ++j) {
    const Index below = size - j;
    QuaternionMatrix<Real> column = g.block(j, j, below, 1);
    if (j > 0)
      column -= lower.block(j, 0, below, j) * lower.block(j, 0, 1, j).conjugate_transpose();
    const Real squared_pivot = column.a(0, 0).real();
    if (!(squared_pivot > tolerance * scale)) return std::nullopt;
    const std::complex<Real> factor(Real(1) / sqrt(squared_pivot));
    lower.a.col(j).tail(below) = column.a * factor;
    lower.b.col(j).tail(below) = column.b * factor;
    lower.set(j, j, Quaternion<Real>(sqrt(squared_pivot)));
  }
  return lower.conjugate_transpose();
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

}  // namespace qdmd
