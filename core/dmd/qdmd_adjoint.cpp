// SPDX-License-Identifier: LGPL-2.1-or-later
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <new>
#include <numeric>

#include "core/dmd/qdmd.h"
#include "core/quaternion/svd.h"

// This procedure is no fast way to anything; it is in the product, and not with the tests' oracles,
// because it is what solver=adjoint promises: the paper, literally.

namespace qdmd {
namespace {

// Every other column, the first included: col_odd of the QSVD that follows the paper's Theorem 3.
Eigen::MatrixXcd odd_columns(const Eigen::MatrixXcd& m, Eigen::Index count) {
  Eigen::MatrixXcd odd(m.rows(), count);
  for (Eigen::Index k = 0; k < count; ++k) odd.col(k) = m.col(2 * k);
  return odd;
}

// The standard eigenvalues among the 2r eigenvalues of an adjoint (the paper's Theorem 2), as r
// indices: of each conjugate pair the one with the non-negative imaginary part. Sorted by real part
// and then by distance from the real axis, pairs are neighbours; a real eigenvalue stands there
// twice.
std::vector<Eigen::Index> standard_eigenvalues(const Eigen::VectorXcd& values) {
  const double tolerance = 1e-9 * std::max(1.0, values.cwiseAbs().maxCoeff());
  std::vector<Eigen::Index> upper, real;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (values(i).imag() > tolerance)
      upper.push_back(i);
    else if (values(i).imag() >= -tolerance)
      real.push_back(i);
  }
  std::sort(real.begin(), real.end(),
            [&](Eigen::Index l, Eigen::Index r) { return values(l).real() < values(r).real(); });
  for (size_t i = 0; i < real.size(); i += 2) upper.push_back(real[i]);
  return upper;
}

}  // namespace

double adjoint_bytes(double pixels, double snapshots) {
  // So many times the adjoint of X, 2n x 2(m - 1) complex doubles: itself, its copies inside the
  // SVD, U, the check of it, and the modes. Measured.
  return 7.4 * sizeof(std::complex<double>) * (2 * pixels) * (2 * std::max(snapshots - 1, 1.0));
}

BackgroundModes qdmd_from_adjoint(const QuaternionMatrixd& x, const DmdOptions& options) {
  using Index = Eigen::Index;
  const Index m = x.cols();
  BackgroundModes result(m);
  if (m < 2 || x.rows() == 0) return result;
  const auto y = x.right_cols(m - 1);

  // Eigen's SVD frees twice what it has where memory runs out in it: so see first that there is
  // enough. A seventh of it, x and y, is there.
  ::operator delete(::operator new(static_cast<size_t>(
      adjoint_bytes(static_cast<double>(x.rows()), static_cast<double>(m)) * 6 / 7)));

  // Algorithm 2, step 1: X = U S V^H, by the complex representation's SVD.
  const auto svd = dense_svd(x.left_cols(m - 1).adjoint());
  const Eigen::VectorXd& doubled = svd.values;
  const double tolerance = static_cast<double>(2 * std::max(x.rows(), m)) *
                           std::numeric_limits<double>::epsilon() * doubled(0);
  Index rank = 0;
  while (2 * rank + 1 < doubled.size() && doubled(2 * rank) > tolerance) ++rank;
  if (options.rank > 0) rank = std::min<Index>(rank, options.rank);
  result.summary.rank = static_cast<int>(rank);
  if (rank == 0) return result;
  Eigen::VectorXd sigma(rank);
  for (Index k = 0; k < rank; ++k) sigma(k) = doubled(2 * k);
  result.summary.condition = sigma(0) / sigma(rank - 1);
  const auto u = QuaternionMatrixd::from_adjoint_columns(odd_columns(svd.u, rank));
  const auto v = QuaternionMatrixd::from_adjoint_columns(odd_columns(svd.v, rank));
  const auto v_over_s = v.scale_cols(sigma.cwiseInverse());

  // Algorithm 2, step 2: Q~ = U^H Y V S^-1.
  const QuaternionMatrixd q_tilde = u.conjugate_transpose() * y * v_over_s;
  // Algorithm 2, step 3: Q~ W = W Lambda, by the eigenvectors of the complex representation.
  const Eigen::ComplexEigenSolver<Eigen::MatrixXcd> eigen(q_tilde.adjoint());
  const auto standard = standard_eigenvalues(eigen.eigenvalues());
  const Index available = static_cast<Index>(standard.size());
  if (eigen.info() != Eigen::Success || available == 0 || !eigen.eigenvectors().allFinite()) {
    if (rank == 1) return result;
    DmdOptions rank_one = options;
    rank_one.rank = 1;
    result = qdmd_from_adjoint(x, rank_one);
    result.summary.converged = false;
    return result;
  }
  Eigen::VectorXcd eigenvalues(available);
  Eigen::MatrixXcd columns(2 * rank, available);
  for (Index k = 0; k < available; ++k) {
    const std::complex<double> value = eigen.eigenvalues()(standard[static_cast<size_t>(k)]);
    eigenvalues(k) = {value.real(), std::max(0.0, value.imag())};
    columns.col(k) = eigen.eigenvectors().col(standard[static_cast<size_t>(k)]);
  }
  const auto w = QuaternionMatrixd::from_adjoint_columns(columns);

  // Algorithm 2, step 4: Phi = Y V S^-1 W; then the background's share.
  const QuaternionMatrixd lower = v_over_s * w;
  const QuaternionMatrixd phi = y * lower;
  const auto chosen = select_background<double>(eigenvalues, options.omega_threshold,
                                                options.max_modes, &result.selection);
  const Index modes = static_cast<Index>(chosen.size());
  result.eigenvalues.resize(modes);
  result.combination = QuaternionMatrixd(m, modes);
  result.reference_times = Eigen::VectorXd::Zero(modes);
  QuaternionMatrixd background(x.rows(), modes);
  for (Index p = 0; p < modes; ++p) {
    const Index k = chosen[static_cast<size_t>(p)];
    result.eigenvalues(p) = eigenvalues(k);
    result.combination.a.col(p).tail(m - 1) = lower.a.col(k);
    result.combination.b.col(p).tail(m - 1) = lower.b.col(k);
    background.a.col(p) = phi.a.col(k);
    background.b.col(p) = phi.b.col(k);
  }
  if (options.amplitude == Amplitude::window) {
    fit_to_window(&result, background, x);
  } else {
    // b = Phi^+ x_1, with all modes.
    const auto b = least_squares<double>(phi, x.col(0));
    result.amplitudes = QuaternionMatrixd(modes, 1);
    for (Index p = 0; p < modes; ++p)
      result.amplitudes.set(p, 0, b.get(chosen[static_cast<size_t>(p)], 0));
  }

  describe_nearest(&result, eigenpair_residual(q_tilde, w.col(chosen[0]), result.eigenvalues(0)));
  return result;
}

}  // namespace qdmd
