// SPDX-License-Identifier: LGPL-2.1-or-later
// Row-major quaternion scalars, and the reflectors of two or three entries that sweep over them.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "core/quaternion/matrix.h"

namespace qdmd {

// A row-major array of quaternion scalars, for algorithms that touch two or three rows at a time.
template <typename Real>
class ScalarGrid {
 public:
  ScalarGrid() = default;
  explicit ScalarGrid(const QuaternionMatrix<Real>& m)
      : cols_(m.cols()), data_(static_cast<size_t>(m.rows() * m.cols())) {
    for (Eigen::Index c = 0; c < m.cols(); ++c)
      for (Eigen::Index r = 0; r < m.rows(); ++r) (*this)(r, c) = m.get(r, c);
  }
  Quaternion<Real>& operator()(Eigen::Index r, Eigen::Index c) {
    return data_[static_cast<size_t>(r * cols_ + c)];
  }
  const Quaternion<Real>& operator()(Eigen::Index r, Eigen::Index c) const {
    return data_[static_cast<size_t>(r * cols_ + c)];
  }
  Eigen::Index cols() const { return cols_; }
  Eigen::Index rows() const {
    return cols_ > 0 ? static_cast<Eigen::Index>(data_.size()) / cols_ : 0;
  }
  QuaternionMatrix<Real> matrix() const {
    QuaternionMatrix<Real> m(rows(), cols_);
    for (Eigen::Index c = 0; c < cols_; ++c)
      for (Eigen::Index r = 0; r < rows(); ++r) m.set(r, c, (*this)(r, c));
    return m;
  }

 private:
  Eigen::Index cols_ = 0;
  std::vector<Quaternion<Real>> data_;
};

// I - tau v v^H on two or three entries; maps the x it is made of to a multiple of e1.
template <typename Real>
struct SmallReflector {
  std::array<Quaternion<Real>, 3> v;
  Real tau{0};
  int size = 0;

  SmallReflector(const std::array<Quaternion<Real>, 3>& x, int size_) : v(x), size(size_) {
    using std::sqrt;
    Real squared(0), largest(0);
    // Scaled by the largest entry: shifts square the entries of the matrix.
    for (int i = 0; i < size; ++i) largest = std::max(largest, v[i].norm());
    if (!(largest > Real(0))) return;
    for (int i = 0; i < size; ++i) {
      v[i] = v[i] * (Real(1) / largest);
      squared += v[i].squared_norm();
    }
    v[0] += v[0].unit() * sqrt(squared);
    squared = Real(0);
    for (int i = 0; i < size; ++i) squared += v[i].squared_norm();
    tau = Real(2) / squared;
  }

  // x(0 .. size - 1) <- (I - tau v v^H) x
  void apply(Quaternion<Real>* x) const {
    Quaternion<Real> w;
    for (int i = 0; i < size; ++i) w += v[i].conj() * x[i];
    w = w * tau;
    for (int i = 0; i < size; ++i) x[i] -= v[i] * w;
  }
  void left(ScalarGrid<Real>& m, Eigen::Index row, Eigen::Index from, Eigen::Index to) const {
    for (Eigen::Index c = from; c < to; ++c) {
      Quaternion<Real> w;
      for (int i = 0; i < size; ++i) w += v[i].conj() * m(row + i, c);
      w = w * tau;
      for (int i = 0; i < size; ++i) m(row + i, c) -= v[i] * w;
    }
  }
  void right(ScalarGrid<Real>& m, Eigen::Index col, Eigen::Index from, Eigen::Index to) const {
    for (Eigen::Index r = from; r < to; ++r) {
      Quaternion<Real> u;
      for (int i = 0; i < size; ++i) u += m(r, col + i) * v[i];
      u = u * tau;
      for (int i = 0; i < size; ++i) m(r, col + i) -= u * v[i].conj();
    }
  }
};

}  // namespace qdmd
