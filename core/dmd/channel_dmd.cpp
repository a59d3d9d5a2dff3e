// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/channel_dmd.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

#include "core/dmd/modes.h"
#include "core/dmd/temporal_model.h"

namespace qdmd {
namespace {

using Index = Eigen::Index;

// Eigenpairs above the tolerance, largest first; at most `limit` where that is positive.
struct Spectrum {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
Spectrum positive_spectrum(const Eigen::MatrixXd& g, Index limit) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(g);
  const Eigen::VectorXd values = eigen.eigenvalues().reverse();
  Index rank = values(0) > 0 ? (values.array() > gram_tolerance(g.rows()) * values(0)).count() : 0;
  if (limit > 0) rank = std::min(rank, limit);
  return {values.head(rank), eigen.eigenvectors().rowwise().reverse().leftCols(rank)};
}

// The nearest modes, `limit` at most, completed by the conjugates of non-real ones.
std::vector<Index> select_with_conjugates(const Eigen::VectorXcd& values, double threshold,
                                          int limit) {
  std::vector<Index> chosen = select_background<double>(values, threshold, limit);
  const size_t count = chosen.size();
  for (size_t i = 0; i < count; ++i) {
    const Index k = chosen[i];
    if (values(k).imag() == 0) continue;
    // Eigen keeps the two of a pair next to each other, the positive imaginary part first.
    const Index partner = values(k).imag() > 0 ? k + 1 : k - 1;
    if (std::find(chosen.begin(), chosen.end(), partner) == chosen.end()) chosen.push_back(partner);
  }
  return chosen;
}

}  // namespace

ChannelModes channel_dmd(const Eigen::MatrixXd& g, const DmdOptions& options) {
  ChannelModes result;
  const Index m = g.rows();
  result.combination.resize(m, 0);
  if (m < 2) return result;
  const auto spectrum = positive_spectrum(g.topLeftCorner(m - 1, m - 1), options.rank);
  const Index rank = spectrum.values.size();
  result.summary.rank = static_cast<int>(rank);
  if (rank == 0) return result;
  // Algorithm 1, step 1: X = U S V^T; V and S^2 are the spectrum of X^T X.
  const Eigen::VectorXd sigma = spectrum.values.cwiseSqrt();
  result.summary.condition = sigma(0) / sigma(rank - 1);
  const Eigen::MatrixXd v_over_s = spectrum.vectors * sigma.cwiseInverse().asDiagonal();
  // Algorithm 1, step 2: A~ = U^T Y V S^-1 = S^-1 V^T X^T Y V S^-1.
  const Eigen::MatrixXd a_tilde = v_over_s.transpose() * g.topRightCorner(m - 1, m - 1) * v_over_s;
  // Algorithm 1, step 3: A~ W = W Lambda.
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(a_tilde);
  if (eigen.info() != Eigen::Success) {
    if (rank == 1) return result;
    DmdOptions rank_one = options;
    rank_one.rank = 1;
    result = channel_dmd(g, rank_one);
    result.summary.converged = false;
    return result;
  }
  const Eigen::VectorXcd values = eigen.eigenvalues();
  const Eigen::MatrixXcd w = eigen.eigenvectors();
  // Algorithm 1, step 4: Phi = Y V S^-1 W, kept as coefficients of the snapshots.
  const Eigen::MatrixXcd lower = v_over_s.cast<std::complex<double>>() * w;

  const auto chosen = select_with_conjugates(values, options.omega_threshold, options.max_modes);
  const Index modes = static_cast<Index>(chosen.size());
  result.eigenvalues.resize(modes);
  result.combination = Eigen::MatrixXcd::Zero(m, modes);
  result.reference_times = Eigen::VectorXd::Zero(modes);
  for (Index p = 0; p < modes; ++p) {
    result.eigenvalues(p) = values(chosen[static_cast<size_t>(p)]);
    result.combination.col(p).tail(m - 1) = lower.col(chosen[static_cast<size_t>(p)]);
  }

  // Columns with the snapshots' inner products stand for the pixels.
  const auto whole = positive_spectrum(g, 0);
  const Eigen::MatrixXcd r = (whole.values.cwiseSqrt().asDiagonal() * whole.vectors.transpose())
                                 .cast<std::complex<double>>();
  const auto least_squares = [](const Eigen::MatrixXcd& matrix, const Eigen::VectorXcd& rhs) {
    const Eigen::VectorXd scale =
        matrix.colwise().norm().unaryExpr([](double v) { return v > 0 ? 1 / v : 0.0; });
    const Eigen::MatrixXcd scaled = matrix * scale.asDiagonal();
    return Eigen::VectorXcd(scale.asDiagonal() *
                            scaled.completeOrthogonalDecomposition().solve(rhs));
  };
  if (options.amplitude == Amplitude::window) {
    const Eigen::MatrixXcd phi = r * result.combination;
    for (Index p = 0; p < modes; ++p)
      result.reference_times(p) = fit_reference_time(result.eigenvalues(p), m);
    // x_t = sum_p phi_p lambda_p^t b_p, all snapshots stacked; P unknowns through the normal
    // equations of the stack.
    Eigen::MatrixXcd powers(modes, m);
    for (Index p = 0; p < modes; ++p)
      for (Index t = 0; t < m; ++t)
        powers(p, t) =
            power(result.eigenvalues(p), static_cast<double>(t) - result.reference_times(p));
    const Eigen::MatrixXcd normal =
        (phi.adjoint() * phi).cwiseProduct(powers.conjugate() * powers.transpose());
    const Eigen::VectorXcd rhs = powers.conjugate().cwiseProduct(phi.adjoint() * r).rowwise().sum();
    result.amplitudes = least_squares(normal, rhs);
  } else {
    Eigen::MatrixXcd all = Eigen::MatrixXcd::Zero(m, rank);
    all.bottomRows(m - 1) = lower;
    // b = Phi^+ x_1, with all modes.
    const Eigen::VectorXcd b = least_squares(r * all, r.col(0));
    result.amplitudes.resize(modes);
    for (Index p = 0; p < modes; ++p) result.amplitudes(p) = b(chosen[static_cast<size_t>(p)]);
  }

  const Index nearest = chosen[0];
  result.summary.background_modes = static_cast<int>(modes);
  result.summary.lambda = {values(nearest).real(), std::abs(values(nearest).imag())};
  result.summary.omega = omega_magnitude(result.summary.lambda);
  const Eigen::VectorXcd error =
      a_tilde.cast<std::complex<double>>() * w.col(nearest) - w.col(nearest) * values(nearest);
  const double size = a_tilde.norm() * w.col(nearest).norm();
  result.summary.residual = size > 0 ? error.norm() / size : 0;
  return result;
}

}  // namespace qdmd
