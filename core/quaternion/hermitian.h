// SPDX-License-Identifier: LGPL-2.1-or-later
// Eigendecomposition of Hermitian quaternion matrices.
#pragma once

#include <Eigen/Eigenvalues>

#include "core/quaternion/householder.h"

namespace qdmd {

// G = V diag(values) V^H, values real and in decreasing order, V unitary.
template <typename Real>
struct HermitianEigen {
  Eigen::Matrix<Real, Eigen::Dynamic, 1> values;
  QuaternionMatrix<Real> vectors;
};

// Quaternion Householder reduction to a tridiagonal matrix, made real by unit quaternions; the
// real problem is Eigen's. No eigenvectors of the complex adjoint are paired, so eigenvalues may
// repeat. Only Hermitian input is meaningful.
template <typename Real>
HermitianEigen<Real> hermitian_eigen(QuaternionMatrix<Real> g) {
  using Index = Eigen::Index;
  using RealVector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  using RealMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Complex = std::complex<Real>;
  const Index size = g.rows();
  HermitianEigen<Real> result;
  if (size == 0) {
    result.vectors = QuaternionMatrix<Real>(0, 0);
    return result;
  }

  QuaternionMatrix<Real> basis = QuaternionMatrix<Real>::identity(size);
  for (Index k = 0; k + 2 < size; ++k) {
    const Index below = size - k - 1;
    const auto h = make_reflector(g.block(k + 1, k, below, 1));
    apply_left(h, g, k + 1, k, size - k);
    apply_right(h, g, k, size - k, k + 1);
    apply_right(h, basis, 0, size, k + 1);
  }

  RealVector diagonal(size), subdiagonal(size > 1 ? size - 1 : 0);
  Quaternion<Real> phase(Real(1));
  diagonal(0) = g.a(0, 0).real();
  for (Index k = 0; k + 1 < size; ++k) {
    const Quaternion<Real> element = g.get(k + 1, k) * phase;
    phase = element.unit();
    basis.scale_col(k + 1, phase);
    subdiagonal(k) = element.norm();
    diagonal(k + 1) = g.a(k + 1, k + 1).real();
  }

  Eigen::SelfAdjointEigenSolver<RealMatrix> solver;
  solver.computeFromTridiagonal(diagonal, subdiagonal, Eigen::ComputeEigenvectors);
  result.values = solver.eigenvalues().reverse();
  const auto rotation = solver.eigenvectors().rowwise().reverse().template cast<Complex>().eval();
  result.vectors = {basis.a * rotation, basis.b * rotation};
  return result;
}

// In double it is compiled once, in double.cpp.
extern template HermitianEigen<double> hermitian_eigen(QuaternionMatrixd);

}  // namespace qdmd
