// SPDX-License-Identifier: LGPL-2.1-or-later
// Arnoldi's method for the dominant eigenvalues of a quaternion operator.
#pragma once

#include <cstdint>

#include "core/quaternion/schur.h"

namespace qdmd {

// A Krylov space of growing dimension, A K = K H + remainder, with its Ritz values.
// `Operator` maps a column of `size` quaternions to another and is linear from the right.
template <typename Real, typename Operator>
class Arnoldi {
 public:
  using Column = std::vector<Quaternion<Real>>;

  Arnoldi(Operator apply, Eigen::Index size) : apply_(std::move(apply)), size_(size) {
    // Any start with a share of every eigenvector would do; a fixed one repeats its result.
    uint64_t state = 1;
    const auto next = [&] {
      state = state * 6364136223846793005u + 1442695040888963407u;
      return Real(static_cast<double>(static_cast<int64_t>(state) >> 11)) * Real(0x1p-52);
    };
    Column start(static_cast<size_t>(size));
    for (auto& q : start) q = Quaternion<Real>(next(), next(), next(), next());
    scale(start, Real(1) / norm(start));
    basis_.push_back(std::move(start));
  }

  Eigen::Index dimension() const { return static_cast<Eigen::Index>(columns_.size()); }
  // The space is invariant: its Ritz pairs are eigenpairs, and more steps would add nothing.
  bool complete() const { return complete_; }

  // Adds a dimension. False where the operator's result is not finite.
  bool step() {
    const size_t j = columns_.size();
    Column w = apply_(basis_[j]);
    const Real before = norm(w);
    // Not a number fails every comparison.
    if (!(before <= std::numeric_limits<Real>::max())) return false;
    Column h(j + 2);
    // Twice, so that the basis stays orthogonal to working accuracy.
    for (int pass = 0; pass < 2; ++pass)
      for (size_t i = 0; i <= j; ++i) {
        const Quaternion<Real> share = dot(basis_[i], w);
        h[i] += share;
        for (size_t k = 0; k < w.size(); ++k) w[k] -= basis_[i][k] * share;
      }
    const Real length = norm(w);
    h[j + 1] = Quaternion<Real>(length);
    columns_.push_back(std::move(h));
    const Real floor = std::numeric_limits<Real>::epsilon() * before;
    complete_ = dimension() == size_ || !(length > floor);
    if (!complete_) {
      scale(w, Real(1) / length);
      basis_.push_back(std::move(w));
    }
    return true;
  }

  struct Ritz {
    std::vector<std::complex<Real>> values;  // largest first
    std::vector<Real> residuals;             // |A v - v value|, |v| = 1
    std::vector<Column> coordinates;         // of v in the basis
    bool converged = false;
  };
  Ritz ritz() const {
    const Eigen::Index j = dimension();
    QuaternionMatrix<Real> h(j, j);
    for (Eigen::Index c = 0; c < j; ++c)
      for (Eigen::Index r = 0; r <= std::min(c + 1, j - 1); ++r)
        h.set(r, c, columns_[static_cast<size_t>(c)][static_cast<size_t>(r)]);
    const auto form = schur(h);
    Ritz result;
    result.converged = form.converged;
    if (!form.converged) return result;
    std::vector<Eigen::Index> order(static_cast<size_t>(j));
    for (Eigen::Index k = 0; k < j; ++k) order[static_cast<size_t>(k)] = k;
    using std::abs;
    std::stable_sort(order.begin(), order.end(), [&](Eigen::Index l, Eigen::Index r) {
      return abs(form.t.a(l, l)) > abs(form.t.a(r, r));
    });
    const Real next = complete_ ? Real(0) : columns_.back().back().w;
    for (Eigen::Index k : order) {
      const auto y = form.q * triangular_eigenvector(form.t, k);
      Column coordinates(static_cast<size_t>(j));
      for (Eigen::Index r = 0; r < j; ++r) coordinates[static_cast<size_t>(r)] = y.get(r, 0);
      result.values.push_back(form.t.a(k, k));
      result.residuals.push_back(next * coordinates.back().norm());
      result.coordinates.push_back(std::move(coordinates));
    }
    return result;
  }

  Column combine(const Column& coordinates) const {
    Column v(static_cast<size_t>(size_));
    for (size_t i = 0; i < coordinates.size(); ++i)
      for (size_t k = 0; k < v.size(); ++k) v[k] += basis_[i][k] * coordinates[i];
    return v;
  }

  static Quaternion<Real> dot(const Column& x, const Column& y) {
    Quaternion<Real> sum;
    for (size_t k = 0; k < x.size(); ++k) sum += x[k].conj() * y[k];
    return sum;
  }
  static Real norm(const Column& x) {
    using std::sqrt;
    Real sum(0);
    for (const auto& q : x) sum += q.squared_norm();
    return sqrt(sum);
  }
  static void scale(Column& x, const Real& factor) {
    for (auto& q : x) q = q * factor;
  }

 private:
  Operator apply_;
  Eigen::Index size_;
  std::vector<Column> basis_, columns_;
  bool complete_ = false;
};

}  // namespace qdmd
