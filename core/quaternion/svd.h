// SPDX-License-Identifier: LGPL-2.1-or-later
// Singular value decomposition of quaternion matrices.
#pragma once

#include <Eigen/QR>
#include <Eigen/SVD>

#include "core/quaternion/householder.h"

namespace qdmd {

// Thin singular value decomposition of a real or complex matrix.
template <typename Matrix>
struct DenseSvd {
  Eigen::Matrix<typename Matrix::RealScalar, Eigen::Dynamic, 1> values;
  Matrix u, v;
};

// Eigen's divide and conquer, checked: in Eigen 3.4 it is wrong by up to a million epsilon in a few
// percent of the matrices that have clusters of singular values. Jacobi's method serves these.
// Good results lie within 4 n epsilon, and few wrong ones below 16 n (34 and 24 of 500 lie above):
// the check's 8 n is between them.
template <typename Matrix>
DenseSvd<Matrix> square_svd(const Matrix& m) {
  using Real = typename Matrix::RealScalar;
  constexpr unsigned kThin = Eigen::ComputeThinU | Eigen::ComputeThinV;
  const auto as_result = [](const auto& svd) {
    return DenseSvd<Matrix>{svd.singularValues(), svd.matrixU(), svd.matrixV()};
  };
  DenseSvd<Matrix> result = as_result(Eigen::BDCSVD<Matrix>(m, kThin));
  const Real tolerance =
      Real(8 * static_cast<double>(m.cols())) * std::numeric_limits<Real>::epsilon();
  const auto orthonormal = [&](const Matrix& q) {
    return (q.adjoint() * q - Matrix::Identity(q.cols(), q.cols())).norm() <= tolerance;
  };
  const Matrix us = result.u * result.values.template cast<typename Matrix::Scalar>().asDiagonal();
  const bool good = (us * result.v.adjoint() - m).norm() <= tolerance * m.norm() &&
                    orthonormal(result.u) && orthonormal(result.v);
  return good ? result : as_result(Eigen::JacobiSVD<Matrix>(m, kThin));
}

// Where Eigen 3.4 makes a matrix square first, it destroys an object and makes another in its
// place: where there is no memory for that, it is destroyed twice. So that is done here.
template <typename Matrix>
DenseSvd<Matrix> dense_svd(const Matrix& m) {
  if (m.rows() == m.cols()) return square_svd(m);
  if (m.rows() < m.cols()) {
    const Matrix tall = m.adjoint();
    DenseSvd<Matrix> result = dense_svd(tall);
    result.u.swap(result.v);
    return result;
  }
  const Eigen::HouseholderQR<Matrix> qr(m);
  const Matrix r = qr.matrixQR().topRows(m.cols()).template triangularView<Eigen::Upper>();
  DenseSvd<Matrix> result = square_svd(r);
  Matrix u = Matrix::Zero(m.rows(), m.cols());
  u.topRows(m.cols()) = result.u;
  u.applyOnTheLeft(qr.householderQ());
  result.u.swap(u);
  return result;
}

// M = U diag(values) V^H: u is rows x k, v is cols x k, both with orthonormal columns,
// k = min(rows, cols), values in decreasing order.
template <typename Real>
struct Svd {
  Eigen::Matrix<Real, Eigen::Dynamic, 1> values;
  QuaternionMatrix<Real> u, v;
};

// Quaternion Householder reduction to a bidiagonal matrix, made real by unit quaternions; the real
// problem is Eigen's. Nothing is squared: small singular values are good to epsilon times the
// largest. Repeated ones need no pairing of columns, as the complex adjoint's do.
template <typename Real>
Svd<Real> svd(QuaternionMatrix<Real> m) {
  using Index = Eigen::Index;
  using RealMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Complex = std::complex<Real>;
  const Index rows = m.rows(), cols = m.cols();
  if (rows < cols) {
    Svd<Real> transposed = svd(m.conjugate_transpose());
    std::swap(transposed.u, transposed.v);
    return transposed;
  }
  Svd<Real> result;
  if (cols == 0) {
    result.u = QuaternionMatrix<Real>(rows, 0);
    result.v = QuaternionMatrix<Real>(0, 0);
    return result;
  }

  const int exponent = m.normalize();
  std::vector<Reflector<Real>> left, right;
  for (Index k = 0; k < cols; ++k) {
    left.push_back(make_reflector(m.block(k, k, rows - k, 1)));
    apply_left(left.back(), m, k, k + 1, cols - k - 1);
    m.set(k, k, left.back().alpha);
    if (k + 2 >= cols) continue;
    right.push_back(make_reflector(m.block(k, k + 1, 1, cols - k - 1).conjugate_transpose()));
    apply_right(right.back(), m, k + 1, rows - k - 1, k + 1);
    m.set(k, k + 1, right.back().alpha.conj());
  }

  // Unit quaternions make the two diagonals real, from the top left on.
  RealMatrix bidiagonal = RealMatrix::Zero(cols, cols);
  QuaternionMatrix<Real> u(rows, cols), v = QuaternionMatrix<Real>::identity(cols);
  Quaternion<Real> column_phase(Real(1));
  for (Index k = 0; k < cols; ++k) {
    v.set(k, k, column_phase);
    const Quaternion<Real> on = m.get(k, k) * column_phase, row_phase = on.unit();
    u.set(k, k, row_phase);
    bidiagonal(k, k) = on.norm();
    if (k + 1 == cols) break;
    const Quaternion<Real> above = row_phase.conj() * m.get(k, k + 1);
    bidiagonal(k, k + 1) = above.norm();
    column_phase = above.unit().conj();
  }
  for (Index k = cols; k-- > 0;) apply_left(left[static_cast<size_t>(k)], u, k, 0, cols);
  for (size_t k = right.size(); k-- > 0;)
    apply_left(right[k], v, static_cast<Index>(k) + 1, 0, cols);

  const auto real = dense_svd(bidiagonal);
  using std::ldexp;
  result.values =
      real.values.unaryExpr([exponent](const Real& value) { return Real(ldexp(value, exponent)); });
  const auto turn_u = real.u.template cast<Complex>().eval();
  const auto turn_v = real.v.template cast<Complex>().eval();
  result.u = {u.a * turn_u, u.b * turn_u};
  result.v = {v.a * turn_v, v.b * turn_v};
  return result;
}

// In double they are compiled once, in svd.cpp.
extern template DenseSvd<Eigen::MatrixXcd> dense_svd(const Eigen::MatrixXcd&);
extern template Svd<double> svd(QuaternionMatrixd);

}  // namespace qdmd
