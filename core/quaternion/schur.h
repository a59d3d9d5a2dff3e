// SPDX-License-Identifier: LGPL-2.1-or-later
// Schur form, standard eigenvalues and eigenvectors of square quaternion matrices.
#pragma once

#include <Eigen/Eigenvalues>

#include "core/quaternion/hessenberg.h"

namespace qdmd {

// A = Q T Q^H, Q unitary, T upper triangular; the diagonal of T holds the standard eigenvalues
// (complex, imaginary part >= 0). `converged` false: the iteration hit its limit, T is not
// triangular and must not be used.
template <typename Real>
struct SchurForm {
  QuaternionMatrix<Real> q, t;
  bool converged = true;

  Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1> eigenvalues() const {
    return t.a.diagonal();
  }
};

namespace internal {

// Schur form of the adjoint of the 2 x 2 block at (k, k): its diagonal holds the block's two
// standard eigenvalues and their conjugates, its first vector an eigenvector of the block.
template <typename Real>
Eigen::ComplexSchur<Eigen::Matrix<std::complex<Real>, 4, 4>> block_schur(ScalarGrid<Real>& h,
                                                                         Eigen::Index k) {
  QuaternionMatrix<Real> block(2, 2);
  for (int r = 0; r < 2; ++r)
    for (int c = 0; c < 2; ++c) block.set(r, c, h(k + r, k + c));
  const Eigen::Matrix<std::complex<Real>, 4, 4> chi = block.adjoint();
  return Eigen::ComplexSchur<Eigen::Matrix<std::complex<Real>, 4, 4>>(chi);
}

}  // namespace internal

// Implicit double-shift QR algorithm on quaternions (Bunse-Gerstner, Byers and Mehrmann 1989):
// the shift polynomial t^2 - 2 Re(s) t + |s|^2 has real coefficients, so it commutes with
// quaternion arithmetic, and one step deflates a whole eigenvalue class. 2 x 2 blocks are split by
// an eigenvector instead: there the polynomial vanishes when both eigenvalues share a class.
template <typename Real>
SchurForm<Real> schur(QuaternionMatrix<Real> m) {
  using Index = Eigen::Index;
  using Q = Quaternion<Real>;
  using std::abs;
  const Index size = m.rows();
  SchurForm<Real> form;
  // By a power of two, which rounds nothing: shift polynomials square the entries.
  const int exponent = m.normalize();
  auto hessenberg_basis = reduce_to_hessenberg(m);
  ScalarGrid<Real> h(m), q(hessenberg_basis);
  const Real epsilon = std::numeric_limits<Real>::epsilon();
  const Real scale = m.norm();
  // Memory for the results.
  m = {};
  hessenberg_basis = {};

  constexpr int kIterationsPerEigenvalue = 60, kPatience = 12;
  int iterations = 0;
  Index hi = size - 1;
  while (hi > 0) {
    Index lo = hi;
    for (; lo > 0; --lo) {
      Real local = h(lo - 1, lo - 1).norm() + h(lo, lo).norm();
      // Small next to its neighbours keeps small eigenvalues accurate; where that never comes (a
      // nilpotent block's diagonal vanishes too), small next to the matrix is still stable.
      if (iterations >= kPatience || !(local > Real(0))) local = scale;
      if (!(h(lo, lo - 1).norm() > epsilon * local)) {
        h(lo, lo - 1) = Q();
        break;
      }
    }
    if (lo == hi) {
      --hi;
      iterations = 0;
      continue;
    }
    if (++iterations > kIterationsPerEigenvalue) {
      form.converged = false;
      return form;
    }
    const auto block = internal::block_schur(h, hi - 1);
    if (block.info() != Eigen::Success) {
      form.converged = false;
      return form;
    }
    if (lo == hi - 1) {
      const auto vector =
          QuaternionMatrix<Real>::from_adjoint_columns(block.matrixU().col(0).eval());
      const SmallReflector<Real> p({vector.get(0, 0), vector.get(1, 0), Q()}, 2);
      p.left(h, lo, lo, size);
      p.right(h, lo, 0, hi + 1);
      p.right(q, lo, 0, size);
      h(hi, lo) = Q();
      hi -= 2;
      iterations = 0;
      continue;
    }

    // Shift: the eigenvalue of the trailing block whose class is nearest to the last element's.
    const Q last = h(hi, hi);
    const std::complex<Real> target(last.w, last.vector_norm());
    std::complex<Real> shift = target;
    if (iterations % 10 == 0) {
      // Exceptional shift against cycles.
      shift = target + std::complex<Real>(h(hi, hi - 1).norm(), h(hi - 1, hi - 2).norm());
    } else {
      Real best = std::numeric_limits<Real>::max();
      for (int i = 0; i < 4; ++i) {
        const std::complex<Real> value(block.matrixT()(i, i).real(),
                                       abs(block.matrixT()(i, i).imag()));
        const Real distance = abs(value - target);
        if (distance < best) best = distance, shift = value;
      }
    }
    const Real trace = Real(2) * shift.real();
    const Real determinant = std::norm(shift);
    const Q h00 = h(lo, lo), h10 = h(lo + 1, lo), h11 = h(lo + 1, lo + 1);
    std::array<Q, 3> bulge = {h00 * h00 + h(lo, lo + 1) * h10 - h00 * trace + Q(determinant),
                              h10 * h00 + h11 * h10 - h10 * trace, h(lo + 2, lo + 1) * h10};
    for (Index k = lo; k < hi; ++k) {
      const int count = static_cast<int>(std::min<Index>(3, hi - k + 1));
      if (k > lo) bulge = {h(k, k - 1), h(k + 1, k - 1), count == 3 ? h(k + 2, k - 1) : Q()};
      const SmallReflector<Real> p(bulge, count);
      p.left(h, k, k > lo ? k - 1 : lo, size);
      p.right(h, k, 0, std::min(k + 3, hi) + 1);
      p.right(q, k, 0, size);
      if (k > lo)
        for (int i = 1; i < count; ++i) h(k + i, k - 1) = Q();
    }
  }

  form.t = h.matrix();
  form.t.scale_by_power_of_two(exponent);
  form.q = q.matrix();
  for (Index k = 0; k < size; ++k) {
    const Q value = form.t.get(k, k);
    const Q d = standardizing_rotation(value);
    form.t.scale_row(k, d.conj());
    form.t.scale_col(k, d);
    form.q.scale_col(k, d);
    form.t.set(k, k, Q(value.w, value.vector_norm(), Real(0), Real(0)));
    for (Index r = k + 1; r < size; ++r) form.t.set(r, k, Q());
  }
  return form;
}

// Eigenvector k of the triangular factor t of a Schur form, T w = w lambda_k: back substitution,
// each step a scalar Sylvester equation lambda_i w - w lambda_k = r, which splits into two complex
// divisions. Result: size x 1, norm 1, zero below k. A repeated eigenvalue divides by epsilon |T|
// instead of zero, so a defective pair yields two nearly parallel vectors, never a NaN.
template <typename Real>
QuaternionMatrix<Real> triangular_eigenvector(const QuaternionMatrix<Real>& t, Eigen::Index k) {
  using Complex = std::complex<Real>;
  using std::abs;
  QuaternionMatrix<Real> w(t.rows(), 1);
  w.a(k, 0) = Complex(Real(1));
  const Complex value = t.a(k, k);
  const Real smallest =
      std::max(std::numeric_limits<Real>::epsilon() * t.norm(), std::numeric_limits<Real>::min());
  const auto safe = [&](Complex divisor) {
    return abs(divisor) < smallest ? Complex(smallest) : divisor;
  };
  for (Eigen::Index i = k; i-- > 0;) {
    const auto r = t.block(i, i + 1, 1, k - i) * w.block(i + 1, 0, k - i, 1);
    w.a(i, 0) = -r.a(0, 0) / safe(t.a(i, i) - value);
    w.b(i, 0) = -r.b(0, 0) / safe(t.a(i, i) - std::conj(value));
    // Keeps growing vectors away from overflow; only the direction matters.
    const Real size = std::max(abs(w.a(i, 0)), abs(w.b(i, 0)));
    if (size > Real(1) / std::numeric_limits<Real>::epsilon()) {
      w.a /= Complex(size);
      w.b /= Complex(size);
    }
  }
  const Complex length(w.norm());
  w.a /= length;
  w.b /= length;
  return w;
}

// Left eigenvector k of the triangular factor t: the row y (1 x size) with y T = lambda_k y, zero
// before column k. Forward substitution, otherwise as triangular_eigenvector().
template <typename Real>
QuaternionMatrix<Real> triangular_left_eigenvector(const QuaternionMatrix<Real>& t,
                                                   Eigen::Index k) {
  using Complex = std::complex<Real>;
  using std::abs;
  const Eigen::Index size = t.rows();
  QuaternionMatrix<Real> y(1, size);
  y.a(0, k) = Complex(Real(1));
  const Complex value = t.a(k, k);
  const Real smallest =
      std::max(std::numeric_limits<Real>::epsilon() * t.norm(), std::numeric_limits<Real>::min());
  const auto safe = [&](Complex divisor) {
    return abs(divisor) < smallest ? Complex(smallest) : divisor;
  };
  for (Eigen::Index i = k + 1; i < size; ++i) {
    const auto r = y.block(0, k, 1, i - k) * t.block(k, i, i - k, 1);
    y.a(0, i) = -r.a(0, 0) / safe(t.a(i, i) - value);
    y.b(0, i) = -r.b(0, 0) / safe(std::conj(t.a(i, i)) - value);
    const Real largest = std::max(abs(y.a(0, i)), abs(y.b(0, i)));
    if (largest > Real(1) / std::numeric_limits<Real>::epsilon()) {
      y.a /= Complex(largest);
      y.b /= Complex(largest);
    }
  }
  return y;
}

// In double they are compiled once, in double.cpp.
extern template SchurForm<double> schur(QuaternionMatrixd);
extern template QuaternionMatrixd triangular_eigenvector(const QuaternionMatrixd&, Eigen::Index);
extern template QuaternionMatrixd triangular_left_eigenvector(const QuaternionMatrixd&,
                                                              Eigen::Index);

}  // namespace qdmd
