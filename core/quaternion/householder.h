// SPDX-License-Identifier: LGPL-2.1-or-later
// Quaternion Householder reflectors H = I - tau v v^H, tau real.
#pragma once

#include "core/quaternion/matrix.h"

namespace qdmd {

// H x = alpha e1 with |alpha| = |x|; H is unitary and Hermitian. tau = 0 is the identity.
template <typename Real>
struct Reflector {
  QuaternionMatrix<Real> v;  // size x 1
  Real tau{0};
  Quaternion<Real> alpha;
};

// The reflector of the column x (size x 1). alpha takes the phase opposite to x_1, so that
// v = x - alpha e1 never cancels.
template <typename Real>
Reflector<Real> make_reflector(QuaternionMatrix<Real> x) {
  Reflector<Real> reflector;
  // Columns of equal frames leave next to nothing of each other, whose square underflows.
  const int exponent = square_is_safe(x.squared_norm()) ? 0 : x.normalize();
  const Quaternion<Real> head = x.get(0, 0);
  const Real length = x.norm();
  if (length > Real(0)) {
    reflector.alpha = head.unit() * -length;
    x.set(0, 0, head - reflector.alpha);
    reflector.tau = Real(2) / x.squared_norm();
    if (exponent != 0) {
      using std::ldexp;
      Quaternion<Real>& a = reflector.alpha;
      a = {Real(ldexp(a.w, exponent)), Real(ldexp(a.x, exponent)), Real(ldexp(a.y, exponent)),
           Real(ldexp(a.z, exponent))};
    }
  }
  reflector.v = std::move(x);
  return reflector;
}

// The block m(row.., col..) <- H m(row.., col..), with as many rows as v and `cols` columns.
template <typename Real>
void apply_left(const Reflector<Real>& h, QuaternionMatrix<Real>& m, Eigen::Index row,
                Eigen::Index col, Eigen::Index cols) {
  using Matrix = typename QuaternionMatrix<Real>::ComplexMatrix;
  using Complex = std::complex<Real>;
  if (h.tau == Real(0) || cols <= 0) return;
  auto ma = m.a.block(row, col, h.v.rows(), cols);
  auto mb = m.b.block(row, col, h.v.rows(), cols);
  const Matrix& va = h.v.a;
  const Matrix& vb = h.v.b;
  const Complex tau(h.tau);
  const Matrix wa = tau * (va.adjoint() * ma + vb.transpose() * mb.conjugate());
  const Matrix wb = tau * (va.adjoint() * mb - vb.transpose() * ma.conjugate());
  ma.noalias() -= va * wa;
  ma.noalias() += vb * wb.conjugate();
  mb.noalias() -= va * wb;
  mb.noalias() -= vb * wa.conjugate();
}

// The block m(row.., col..) <- m(row.., col..) H, with `rows` rows and as many columns as v.
template <typename Real>
void apply_right(const Reflector<Real>& h, QuaternionMatrix<Real>& m, Eigen::Index row,
                 Eigen::Index rows, Eigen::Index col) {
  using Matrix = typename QuaternionMatrix<Real>::ComplexMatrix;
  using Complex = std::complex<Real>;
  if (h.tau == Real(0) || rows <= 0) return;
  auto ma = m.a.block(row, col, rows, h.v.rows());
  auto mb = m.b.block(row, col, rows, h.v.rows());
  const Matrix& va = h.v.a;
  const Matrix& vb = h.v.b;
  const Complex tau(h.tau);
  const Matrix ua = tau * (ma * va - mb * vb.conjugate());
  const Matrix ub = tau * (ma * vb + mb * va.conjugate());
  ma.noalias() -= ua * va.adjoint();
  ma.noalias() -= ub * vb.adjoint();
  mb.noalias() += ua * vb.transpose();
  mb.noalias() -= ub * va.transpose();
}

// In double they are compiled once, in double.cpp.
extern template Reflector<double> make_reflector(QuaternionMatrixd);
extern template void apply_left(const Reflector<double>&, QuaternionMatrixd&, Eigen::Index,
                                Eigen::Index, Eigen::Index);
extern template void apply_right(const Reflector<double>&, QuaternionMatrixd&, Eigen::Index,
                                 Eigen::Index, Eigen::Index);

}  // namespace qdmd
