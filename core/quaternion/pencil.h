// SPDX-License-Identifier: LGPL-2.1-or-later
// The eigenvalue of a Hessenberg pencil that is nearest to one, with both eigenvectors.
#pragma once

#include <optional>

#include "core/quaternion/arnoldi.h"
#include "core/quaternion/hessenberg.h"

namespace qdmd {

// H v = B v lambda, lambda standard (imaginary part >= 0), |v| = 1.
template <typename Real>
struct PencilEigenpair {
  std::complex<Real> value;
  std::vector<Quaternion<Real>> vector;
  Real residual;  // |H v - B v lambda| / (|H| + |lambda| |B|), at most 50 size epsilon
  // How much farther the next eigenvalue is, in |ln lambda|; infinite where there is none. Not
  // `exact`: at least so much.
  Real margin;
  bool exact;
};

// H v = B v lambda with H upper Hessenberg, B upper triangular with a non-zero diagonal, both
// size x size. Shift and invert at the real shift 1: the operator (H - B)^-1 B has the eigenvalues
// 1 / (lambda - 1), so that Arnoldi's method (inverse iteration that remembers its steps) finds
// those next to 1 first. H - B is factorized once; a step is O(size^2).
template <typename Real>
class Pencil {
 public:
  using Column = std::vector<Quaternion<Real>>;

  Pencil(const QuaternionMatrix<Real>& h, const QuaternionMatrix<Real>& b)
      : h_(h), b_(b), shifted_(h - b), size_(h.rows()) {
    const Real scale = h.norm() + b.norm();
    shifted_.raise_pivots(
        std::max(std::numeric_limits<Real>::epsilon() * scale, std::numeric_limits<Real>::min()));
  }

  // The eigenpair with the smallest |ln lambda|, |v| = 1. Empty where the nearest eigenvalues are
  // so crowded (or so defective) that kMaxSteps steps cannot tell them apart: take the Schur form.
  std::optional<PencilEigenpair<Real>> nearest() const {
    using std::abs, std::log;
    Arnoldi<Real, Forward> space(Forward{this}, size_);
    while (!space.complete() && space.dimension() < kMaxSteps) {
      if (!space.step()) return std::nullopt;
      if (!space.complete() && space.dimension() % kStepsPerCheck != 0) continue;
      const auto ritz = space.ritz();
      if (!ritz.converged) return std::nullopt;
      // Candidates are the dominant Ritz values that have settled.
      size_t settled = 0;
      while (settled < ritz.values.size() &&
             !(ritz.residuals[settled] > tolerance() * abs(ritz.values[settled])))
        ++settled;
      if (settled == 0) continue;
      size_t best = 0;
      Real nearest = std::numeric_limits<Real>::max(), next = nearest;
      for (size_t k = 0; k < settled; ++k) {
        if (!(abs(ritz.values[k]) > Real(0))) continue;
        const Real distance = qdmd::log(Quaternion<Real>(eigenvalue(ritz.values[k]))).norm();
        if (distance < nearest)
          next = nearest, nearest = distance, best = k;
        else
          next = std::min(next, distance);
      }
      if (!space.complete()) {
        // |lambda - 1| >= d implies |ln lambda| >= ln(1 + d): nothing beyond the first unsettled
        // value can be nearer. Half of its residual's room is left for what is not seen yet.
        if (settled == ritz.values.size()) continue;
        const Real reach = abs(ritz.values[settled]) + Real(2) * ritz.residuals[settled];
        const Real beyond = log(Real(1) + Real(1) / reach);
        if (!(nearest < beyond)) continue;
        next = std::min(next, beyond);
      }
      auto pair = polished(space.combine(ritz.coordinates[best]));
      if (!pair) return std::nullopt;
      const bool alone = !(next < std::numeric_limits<Real>::max());
      pair->margin = alone ? std::numeric_limits<Real>::infinity() : Real(next - nearest);
      pair->exact = space.complete();
      return pair;
    }
    return std::nullopt;
  }

  // u with u^H H = lambda' u^H B for a lambda' of the class of `lambda`, which nearest() found.
  std::optional<Column> left_vector(const std::complex<Real>& lambda) const {
    using std::abs;
    const std::complex<Real> target = standard(Quaternion<Real>(lambda - Real(1)).inverse());
    Arnoldi<Real, Backward> space(Backward{this}, size_);
    while (!space.complete() && space.dimension() < kMaxSteps) {
      if (!space.step()) return std::nullopt;
      if (!space.complete() && space.dimension() % kStepsPerCheck != 0) continue;
      const auto ritz = space.ritz();
      if (!ritz.converged) return std::nullopt;
      size_t best = 0;
      for (size_t k = 1; k < ritz.values.size(); ++k)
        if (abs(ritz.values[k] - target) < abs(ritz.values[best] - target)) best = k;
      if (space.complete() || !(ritz.residuals[best] > tolerance() * abs(ritz.values[best])))
        return space.combine(ritz.coordinates[best]);
    }
    return std::nullopt;
  }

 private:
  static constexpr Eigen::Index kMaxSteps = 60, kStepsPerCheck = 4;
  static Real tolerance() { return Real(16) * std::numeric_limits<Real>::epsilon(); }

  struct Forward {
    const Pencil* pencil;
    Column operator()(const Column& x) const {
      return pencil->shifted_.solve(multiply_upper(pencil->b_, x));
    }
  };
  struct Backward {
    const Pencil* pencil;
    Column operator()(const Column& x) const {
      return pencil->shifted_.solve_adjoint(multiply_upper_adjoint(pencil->b_, x));
    }
  };

  // The standard member (imaginary part >= 0) of a class.
  static std::complex<Real> standard(const Quaternion<Real>& q) { return {q.w, q.vector_norm()}; }
  // lambda for the operator's eigenvalue mu, in its own class.
  static std::complex<Real> eigenvalue(const std::complex<Real>& mu) {
    return standard(Quaternion<Real>(Real(1)) + Quaternion<Real>(mu).inverse());
  }

  // One more step of inverse iteration, and its Rayleigh quotient.
  std::optional<PencilEigenpair<Real>> polished(Column v) const {
    using Space = Arnoldi<Real, Forward>;
    Quaternion<Real> mu;
    for (int pass = 0; pass < 2; ++pass) {
      Column w = Forward{this}(v);
      mu = Space::dot(v, w);
      const Real length = Space::norm(w);
      if (!(length > Real(0)) || !(length <= std::numeric_limits<Real>::max())) return std::nullopt;
      // v keeps its own phase: mu belongs to it.
      if (pass == 0) {
        Space::scale(w, Real(1) / length);
        v = std::move(w);
      }
    }
    const Quaternion<Real> lambda = Quaternion<Real>(Real(1)) + mu.inverse();
    const Quaternion<Real> turn = standardizing_rotation(lambda);
    for (auto& q : v) q = q * turn;
    PencilEigenpair<Real> pair{standard(lambda), std::move(v), Real(0), Real(0), false};
    pair.residual = residual(pair);
    // A step's rounding is small next to the operator, which is 1 / epsilon in size where 1 itself
    // is a defective eigenvalue: only this tells whether the pair is one.
    const Real limit = Real(50 * static_cast<double>(size_)) * std::numeric_limits<Real>::epsilon();
    if (!(pair.residual <= limit)) return std::nullopt;
    return pair;
  }

  Real residual(const PencilEigenpair<Real>& pair) const {
    using std::sqrt;
    const Quaternion<Real> lambda(pair.value);
    const Column bv = multiply_upper(b_, pair.vector);
    Real error(0), h_squared(0), b_squared(0);
    for (Eigen::Index i = 0; i < size_; ++i) {
      Quaternion<Real> sum = -(bv[static_cast<size_t>(i)] * lambda);
      for (Eigen::Index k = std::max<Eigen::Index>(i - 1, 0); k < size_; ++k) {
        sum += h_(i, k) * pair.vector[static_cast<size_t>(k)];
        h_squared += h_(i, k).squared_norm();
        b_squared += b_(i, k).squared_norm();
      }
      error += sum.squared_norm();
    }
    return sqrt(error) / (sqrt(h_squared) + lambda.norm() * sqrt(b_squared));
  }

  ScalarGrid<Real> h_, b_;
  HessenbergQr<Real> shifted_;
  Eigen::Index size_;
};

}  // namespace qdmd
