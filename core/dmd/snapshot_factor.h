// SPDX-License-Identifier: LGPL-2.1-or-later
// A small matrix that stands for the snapshots: all that Q-DMD asks of the pixels' geometry.
#pragma once

#include "core/dmd/modes.h"
#include "core/quaternion/factorize.h"

namespace qdmd {

// Columns (k x m, k <= m) with the inner products of the snapshots: R^H R = [x_1 .. x_m]^H [x_1 ..
// x_m]. R is a factor of the QR factorization of the snapshots, up to a unitary matrix.
template <typename Real>
struct SnapshotFactor {
  QuaternionMatrix<Real> r;
  // R is upper trapezoidal; its diagonal is real and positive but for the last element.
  bool triangular = false;
  // R comes from a Gram matrix in its own precision: singular values are known to the square root
  // of epsilon only, so that a squared problem loses nothing.
  bool squared = false;
  // Singular values of X = [x_1 .. x_{m-1}] below this times the largest count as zero.
  Real tolerance{0};
};

// From the Gram matrix, factorized in `Real`. In order at full rank of X; else with pivoting, which
// leaves a factor of as many rows as the rank.
template <typename Real>
SnapshotFactor<Real> factorize_gram(const QuaternionMatrix<Real>& g) {
  using std::sqrt;
  const Eigen::Index m = g.rows();
  SnapshotFactor<Real> factor;
  factor.squared = true;
  factor.tolerance = sqrt(gram_tolerance<Real>(m));
  auto in_order = cholesky(g, gram_tolerance<Real>(m));
  factor.triangular = in_order.pivots >= m - 1;
  factor.r = factor.triangular ? std::move(in_order.r)
                               : pivoted_cholesky(g, std::numeric_limits<Real>::epsilon()).r;
  return factor;
}

}  // namespace qdmd
