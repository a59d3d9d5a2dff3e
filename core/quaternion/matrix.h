// SPDX-License-Identifier: LGPL-2.1-or-later
// Quaternion matrices as A + B j on two complex Eigen matrices.
#pragma once

#include <Eigen/Core>

#include "core/quaternion/quaternion.h"

namespace qdmd {

// M = a + b j, both rows x cols. Column-major. Vectors are one-column matrices.
// Quaternions do not commute: scalars multiply columns from the right (M.col * scalar).
template <typename Real>
class QuaternionMatrix {
 public:
  using Complex = std::complex<Real>;
  using ComplexMatrix = Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic>;
  using RealMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Scalar = Quaternion<Real>;
  using Index = Eigen::Index;

  ComplexMatrix a, b;

  QuaternionMatrix() = default;
  // All zero.
  QuaternionMatrix(Index rows, Index cols)
      : a(ComplexMatrix::Zero(rows, cols)), b(ComplexMatrix::Zero(rows, cols)) {}
  QuaternionMatrix(ComplexMatrix a_, ComplexMatrix b_) : a(std::move(a_)), b(std::move(b_)) {
    eigen_assert(a.rows() == b.rows() && a.cols() == b.cols());
  }
  static QuaternionMatrix identity(Index size) {
    return {ComplexMatrix::Identity(size, size), ComplexMatrix::Zero(size, size)};
  }

  Index rows() const { return a.rows(); }
  Index cols() const { return a.cols(); }

  Scalar get(Index row, Index col) const { return Scalar(a(row, col), b(row, col)); }
  void set(Index row, Index col, const Scalar& q) {
    a(row, col) = q.a();
    b(row, col) = q.b();
  }

  QuaternionMatrix block(Index row, Index col, Index rows, Index cols) const {
    return {a.block(row, col, rows, cols), b.block(row, col, rows, cols)};
  }
  QuaternionMatrix col(Index c) const { return {a.col(c), b.col(c)}; }
  QuaternionMatrix left_cols(Index count) const { return {a.leftCols(count), b.leftCols(count)}; }
  QuaternionMatrix right_cols(Index count) const {
    return {a.rightCols(count), b.rightCols(count)};
  }

  // (A + B j)^H = A^H - B^T j.
  QuaternionMatrix conjugate_transpose() const { return {a.adjoint(), -b.transpose()}; }

  Real squared_norm() const { return a.squaredNorm() + b.squaredNorm(); }
  // Frobenius norm.
  Real norm() const {
    using std::sqrt;
    return sqrt(squared_norm());
  }
  // Divides by the power of two that brings the largest part near one, and returns its exponent
  // (0 for a zero matrix). No digit is lost but to underflow.
  int normalize() {
    using std::frexp;
    if (a.size() == 0) return 0;
    const Real largest = std::max({a.real().cwiseAbs().maxCoeff(), a.imag().cwiseAbs().maxCoeff(),
                                   b.real().cwiseAbs().maxCoeff(), b.imag().cwiseAbs().maxCoeff()});
    int exponent = 0;
    if (largest > Real(0)) (void)frexp(largest, &exponent);
    scale_by_power_of_two(-exponent);
    return exponent;
  }
  void scale_by_power_of_two(int exponent) {
    using std::ldexp;
    const auto scale = [exponent](const Complex& c) {
      return Complex(ldexp(c.real(), exponent), ldexp(c.imag(), exponent));
    };
    if (exponent == 0) return;
    a = a.unaryExpr(scale).eval();
    b = b.unaryExpr(scale).eval();
  }

  bool all_finite() const { return a.allFinite() && b.allFinite(); }

  // Columns times real numbers: M diag(d).
  template <typename Derived>
  QuaternionMatrix scale_cols(const Eigen::MatrixBase<Derived>& d) const {
    const auto diagonal = d.template cast<Complex>().asDiagonal();
    return {a * diagonal, b * diagonal};
  }
  // Column c times the quaternion q from the right.
  void scale_col(Index c, const Scalar& q) {
    const Complex qa = q.a(), qb = q.b();
    const auto old_a = a.col(c).eval();
    a.col(c) = old_a * qa - b.col(c) * std::conj(qb);
    b.col(c) = old_a * qb + b.col(c) * std::conj(qa);
  }
  // Row r times the quaternion q from the left.
  void scale_row(Index r, const Scalar& q) {
    const Complex qa = q.a(), qb = q.b();
    const auto old_a = a.row(r).eval();
    const auto old_b = b.row(r).eval();
    a.row(r) = qa * old_a - qb * old_b.conjugate();
    b.row(r) = qa * old_b + qb * old_a.conjugate();
  }

  // The 2 rows x 2 cols complex adjoint [A B; -conj(B) conj(A)] (the paper's Definition 6,
  // "Complex representation"), a homomorphism: adjoint(P Q) = adjoint(P) adjoint(Q).
  ComplexMatrix adjoint() const {
    ComplexMatrix chi(2 * rows(), 2 * cols());
    chi << a, b, -b.conjugate(), a.conjugate();
    return chi;
  }
  // The inverse of adjoint(), from the left half [x1; x2] alone: x1 - conj(x2) j (the paper's
  // map after Theorem 2). `left` is 2 rows x cols.
  template <typename Derived>
  static QuaternionMatrix from_adjoint_columns(const Eigen::MatrixBase<Derived>& left) {
    const Index half = left.rows() / 2;
    return {left.topRows(half), -left.bottomRows(half).conjugate()};
  }
  static QuaternionMatrix from_adjoint(const ComplexMatrix& chi) {
    return from_adjoint_columns(chi.leftCols(chi.cols() / 2));
  }

  QuaternionMatrix& operator+=(const QuaternionMatrix& m) {
    a += m.a;
    b += m.b;
    return *this;
  }
  QuaternionMatrix& operator-=(const QuaternionMatrix& m) {
    a -= m.a;
    b -= m.b;
    return *this;
  }
  friend QuaternionMatrix operator+(QuaternionMatrix p, const QuaternionMatrix& q) {
    p += q;
    return p;
  }
  friend QuaternionMatrix operator-(QuaternionMatrix p, const QuaternionMatrix& q) {
    p -= q;
    return p;
  }
  friend QuaternionMatrix operator*(const QuaternionMatrix& p, const QuaternionMatrix& q) {
    return product_of(p, q);
  }
};

using QuaternionMatrixd = QuaternionMatrix<double>;

template <typename Real>
QuaternionMatrix<Real> product_of(const QuaternionMatrix<Real>& p,
                                  const QuaternionMatrix<Real>& q) {
  eigen_assert(p.cols() == q.rows());
  QuaternionMatrix<Real> product;
  product.a.noalias() = p.a * q.a;
  product.a.noalias() -= p.b * q.b.conjugate();
  product.b.noalias() = p.a * q.b;
  product.b.noalias() += p.b * q.a.conjugate();
  return product;
}

// In double it is compiled once, in double.cpp.
extern template QuaternionMatrixd product_of(const QuaternionMatrixd&, const QuaternionMatrixd&);

}  // namespace qdmd
