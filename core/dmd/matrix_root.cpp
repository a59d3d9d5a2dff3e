// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/matrix_root.h"

#include "core/quaternion/factorize.h"
#include "core/quaternion/schur.h"

namespace qdmd {
namespace {

using Index = Eigen::Index;
using Matrix = QuaternionMatrixd;

// x / (left + right), or nothing where these are nearly opposite.
std::complex<double> quotient(const std::complex<double>& x, const std::complex<double>& left,
                              const std::complex<double>& right) {
  constexpr double kOpposite = 0.1;
  const std::complex<double> sum = left + right;
  const bool opposite = !(std::abs(sum) > kOpposite * (std::abs(left) + std::abs(right)));
  return opposite ? std::complex<double>() : x / sum;
}

}  // namespace

Matrix inverse(const Matrix& a) {
  const auto factors = qr(a);
  return solve_upper(factors.r, factors.q.conjugate_transpose());
}

std::optional<Matrix> root_near(const Matrix& square, const Matrix& near) {
  constexpr int kMostSteps = 20;
  Matrix root = near;
  const Index size = near.rows();
  for (int step = 0; step < kMostSteps; ++step) {
    const auto form = schur(root);
    if (!form.converged) return std::nullopt;
    const auto values = form.eigenvalues();
    Matrix vectors(size, size);
    for (Index k = 0; k < size; ++k) {
      const auto v = form.q * triangular_eigenvector(form.t, k);
      vectors.a.col(k) = v.a;
      vectors.b.col(k) = v.b;
    }
    const Matrix back = inverse(vectors);
    Matrix move = back * (square - root * root) * vectors;
    // lambda (a + b j) + (a + b j) mu = (lambda + mu) a + (lambda + conj(mu)) b j.
    for (Index c = 0; c < size; ++c)
      for (Index r = 0; r < size; ++r) {
        move.a(r, c) = quotient(move.a(r, c), values(r), values(c));
        move.b(r, c) = quotient(move.b(r, c), values(r), std::conj(values(c)));
      }
    move = vectors * move * back;
    root += move;
    if (!root.all_finite()) return std::nullopt;
    if (move.norm() <= 1e-12 * root.norm()) return root;
  }
  return std::nullopt;
}

}  // namespace qdmd
