// SPDX-License-Identifier: LGPL-2.1-or-later
// Hessenberg form of quaternion matrices, and linear systems with Hessenberg matrices.
#pragma once

#include "core/quaternion/householder.h"
#include "core/quaternion/small_reflector.h"

namespace qdmd {

// Reduces m to upper Hessenberg form in place and returns Q with m_before = Q m_after Q^H.
template <typename Real>
QuaternionMatrix<Real> reduce_to_hessenberg(QuaternionMatrix<Real>& m) {
  const Eigen::Index size = m.rows();
  auto q = QuaternionMatrix<Real>::identity(size);
  for (Eigen::Index k = 0; k + 2 < size; ++k) {
    const Eigen::Index below = size - k - 1;
    // A column that is in the form already, as a pencil's is.
    if (m.a.col(k).tail(below - 1).isZero(Real(0)) && m.b.col(k).tail(below - 1).isZero(Real(0)))
      continue;
    const auto h = make_reflector(m.block(k + 1, k, below, 1));
    apply_left(h, m, k + 1, k + 1, below);
    m.a.col(k).tail(below).setZero();
    m.b.col(k).tail(below).setZero();
    m.set(k + 1, k, h.alpha);
    apply_right(h, m, 0, size, k + 1);
    apply_right(h, q, 0, size, k + 1);
  }
  return q;
}

// y <- R x for upper triangular R, and y <- R^H x.
template <typename Real>
std::vector<Quaternion<Real>> multiply_upper(const ScalarGrid<Real>& r,
                                             const std::vector<Quaternion<Real>>& x) {
  const auto size = static_cast<Eigen::Index>(x.size());
  std::vector<Quaternion<Real>> y(x.size());
  for (Eigen::Index i = 0; i < size; ++i)
    for (Eigen::Index k = i; k < size; ++k)
      y[static_cast<size_t>(i)] += r(i, k) * x[static_cast<size_t>(k)];
  return y;
}
template <typename Real>
std::vector<Quaternion<Real>> multiply_upper_adjoint(const ScalarGrid<Real>& r,
                                                     const std::vector<Quaternion<Real>>& x) {
  const auto size = static_cast<Eigen::Index>(x.size());
  std::vector<Quaternion<Real>> y(x.size());
  for (Eigen::Index i = 0; i < size; ++i)
    for (Eigen::Index k = i; k < size; ++k)
      y[static_cast<size_t>(k)] += r(i, k).conj() * x[static_cast<size_t>(i)];
  return y;
}

// x <- R^-1 x and x <- R^-H x for upper triangular R with a non-zero diagonal.
template <typename Real>
void solve_upper_in_place(const ScalarGrid<Real>& r, std::vector<Quaternion<Real>>& x) {
  for (auto i = static_cast<Eigen::Index>(x.size()); i-- > 0;) {
    Quaternion<Real> sum = x[static_cast<size_t>(i)];
    for (Eigen::Index k = i + 1; k < static_cast<Eigen::Index>(x.size()); ++k)
      sum -= r(i, k) * x[static_cast<size_t>(k)];
    x[static_cast<size_t>(i)] = r(i, i).inverse() * sum;
  }
}
template <typename Real>
void solve_upper_adjoint_in_place(const ScalarGrid<Real>& r, std::vector<Quaternion<Real>>& x) {
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(x.size()); ++i) {
    const Quaternion<Real> value = r(i, i).conj().inverse() * x[static_cast<size_t>(i)];
    x[static_cast<size_t>(i)] = value;
    for (Eigen::Index k = i + 1; k < static_cast<Eigen::Index>(x.size()); ++k)
      x[static_cast<size_t>(k)] -= r(i, k).conj() * value;
  }
}

// S = Q T for upper Hessenberg S (rows x cols, rows = cols or cols + 1), in O(size^2).
template <typename Real>
class HessenbergQr {
 public:
  using Column = std::vector<Quaternion<Real>>;

  explicit HessenbergQr(const QuaternionMatrix<Real>& s) : t_(s) {
    const Eigen::Index cols = s.cols();
    const Eigen::Index sweeps = std::min(s.rows() - 1, cols);
    for (Eigen::Index k = 0; k < sweeps; ++k) {
      reflectors_.emplace_back(
          std::array<Quaternion<Real>, 3>{t_(k, k), t_(k + 1, k), Quaternion<Real>()}, 2);
      reflectors_.back().left(t_, k, k, cols);
    }
  }

  // The smallest |T_kk|.
  Real smallest_pivot() const {
    Real smallest = std::numeric_limits<Real>::max();
    for (Eigen::Index k = 0; k < t_.cols(); ++k) smallest = std::min(smallest, t_(k, k).norm());
    return smallest;
  }
  // Replaces pivots below `floor` by it: inverse iteration wants a solution that is large in the
  // right direction where there is none.
  void raise_pivots(Real floor) {
    for (Eigen::Index k = 0; k < t_.cols(); ++k)
      if (!(t_(k, k).norm() > floor)) t_(k, k) = Quaternion<Real>(floor);
  }

  // The x (cols) that minimizes |S x - y|; exact for square S.
  Column solve(Column y) const {
    for (size_t k = 0; k < reflectors_.size(); ++k) reflectors_[k].apply(&y[k]);
    y.resize(static_cast<size_t>(t_.cols()));
    solve_upper_in_place(t_, y);
    return y;
  }
  // x with S^H x = y, square S only.
  Column solve_adjoint(Column y) const {
    solve_upper_adjoint_in_place(t_, y);
    for (size_t k = reflectors_.size(); k-- > 0;) reflectors_[k].apply(&y[k]);
    return y;
  }

 private:
  ScalarGrid<Real> t_;
  std::vector<SmallReflector<Real>> reflectors_;
};

// In double it is compiled once, in double.cpp.
extern template QuaternionMatrixd reduce_to_hessenberg(QuaternionMatrixd&);

}  // namespace qdmd
