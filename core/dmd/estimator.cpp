// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/estimator.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <optional>

#include "core/dmd/matrix_root.h"

namespace qdmd {
namespace {

using Index = Eigen::Index;
using Matrix = QuaternionMatrixd;

// Not a number is no result.
std::optional<BackgroundModes> checked(std::optional<BackgroundModes> modes, Index rank,
                                       double condition) {
  if (!modes || !modes->combination.all_finite() || !modes->amplitudes.all_finite() ||
      !modes->eigenvalues.allFinite())
    return std::nullopt;
  modes->summary.rank = static_cast<int>(rank);
  modes->summary.condition = condition;
  return modes;
}

std::optional<BackgroundModes> forward_backward_modes(const SnapshotFactor<double>& factor,
                                                      const DmdOptions& options) {
  const Index later = factor.r.cols() - 1;
  const auto spectrum = internal::past_spectrum(factor, Index{options.rank});
  const Index rank = spectrum.sigma.size();
  if (rank == 0) return BackgroundModes(factor.r.cols());
  const auto u_h = spectrum.u.conjugate_transpose();
  const Matrix past = u_h * factor.r.left_cols(later), next = u_h * factor.r.right_cols(later);
  const auto past_h = past.conjugate_transpose(), next_h = next.conjugate_transpose();
  // A_f = (Y X^H) (X X^H)^-1 and A_b^-1 = (Y Y^H) (X Y^H)^-1.
  const Matrix forward = (next * past_h) * inverse(past * past_h);
  const Matrix square = forward * (next * next_h) * inverse(past * next_h);
  if (!square.all_finite()) return std::nullopt;
  const auto root = root_near(square, forward);
  if (!root) return std::nullopt;
  const internal::Projection<double> projection{spectrum.v_over_s, *root};
  // The noise that is kept beside the background has eigenvalues all around the unit circle here:
  // time turned back grows as much as time shrinks. Those of exact are near 0.
  return checked(internal::modes_from_schur_form(projection, factor, options, &forward), rank,
                 spectrum.sigma(0) / spectrum.sigma(rank - 1));
}

std::optional<BackgroundModes> total_modes(const SnapshotFactor<double>& factor,
                                           const DmdOptions& options) {
  const Index later = factor.r.cols() - 1, rows = factor.r.rows();
  const Matrix past = factor.r.left_cols(later), next = factor.r.right_cols(later);
  Matrix both(2 * rows, later);
  both.a << past.a, next.a;
  both.b << past.b, next.b;
  // The right singular vectors of `both` are the left ones of its transpose.
  Matrix common;
  const auto turned = both.conjugate_transpose();
  if (options.rank == 1) {
    if (const auto leading = internal::leading_spectrum<double>(turned)) common = leading->u;
  }
  if (common.cols() == 0) {
    auto eigen = hermitian_eigen(turned * both);
    Index rank = 0;
    while (rank < std::min<Index>(eigen.values.size(), options.rank) &&
           eigen.values(rank) > factor.tolerance * factor.tolerance * eigen.values(0) &&
           eigen.values(rank) > 0)
      ++rank;
    common = eigen.vectors.left_cols(rank);
  }
  // X W may have a lower rank than [X; Y] W: a factorization that shows it.
  const auto factors = qr(past * common);
  Index rank = 0;
  double largest = 0, smallest = 0;
  for (; rank < common.cols() && rank < rows; ++rank) {
    const double pivot = factors.r.a(rank, rank).real();
    largest = std::max(largest, pivot);
    if (!(pivot > std::max(factor.tolerance, 1e-12) * largest)) break;
    smallest = rank == 0 ? pivot : std::min(smallest, pivot);
  }
  if (rank == 0) return BackgroundModes(factor.r.cols());
  const auto t = factors.r.block(0, 0, rank, rank);
  const internal::Projection<double> projection{
      common.left_cols(rank) * solve_upper(t, Matrix::identity(rank)),
      factors.q.left_cols(rank).conjugate_transpose() *
          (next * (common.left_cols(rank) * solve_upper(t, Matrix::identity(rank))))};
  return checked(internal::modes_from_schur_form(projection, factor, options), rank,
                 largest / smallest);
}

// |X P_E|^2 for the projection P_E on the rows of E, E_pt = exp(q_p t), and the coefficients E^+
// (m x P) of the best modes. Each q_p is a whole quaternion: phi lambda^t b = (phi b) (b^-1 lambda
// b)^t, so that its direction is what an amplitude b says.
class ExponentialFit {
 public:
  explicit ExponentialFit(const Matrix& r) : gram_(r.conjugate_transpose() * r) {}

  // logs: four parts of each q_p.
  double explained(const Eigen::VectorXd& logs) const {
    const Matrix e = rows(logs), e_h = e.conjugate_transpose();
    const double value = (inverse(e * e_h) * (e * (gram_ * e_h))).a.trace().real();
    return std::isfinite(value) ? value : -1;
  }
  Matrix coefficients(const Eigen::VectorXd& logs) const {
    const Matrix e = rows(logs), e_h = e.conjugate_transpose();
    return e_h * inverse(e * e_h);
  }
  static Quaterniond log_of(const Eigen::VectorXd& logs, Index p) {
    return {logs(4 * p), logs(4 * p + 1), logs(4 * p + 2), logs(4 * p + 3)};
  }

 private:
  // Growing rows count from the last frame, which changes no projection.
  Matrix rows(const Eigen::VectorXd& logs) const {
    const Index modes = logs.size() / 4, m = gram_.rows();
    Matrix e(modes, m);
    for (Index p = 0; p < modes; ++p) {
      const Quaterniond log = log_of(logs, p);
      const double reference = log.w > 0 ? static_cast<double>(m - 1) : 0;
      for (Index t = 0; t < m; ++t) e.set(p, t, exp(log * (static_cast<double>(t) - reference)));
    }
    return e;
  }

  Matrix gram_;
};

// Newton's method for the largest explained(), damped as Levenberg and Marquardt do, with central
// differences: 4P unknowns, of which there are few.
Eigen::VectorXd fitted(const ExponentialFit& fit, Eigen::VectorXd logs, double frames) {
  constexpr int kMostSteps = 40;
  const Index size = logs.size();
  // A turn by so much of a cycle over the window is seen, and rounded to half its digits.
  const double h = 1e-3 / frames;
  double value = fit.explained(logs), damping = 1e-3;
  for (int step = 0; step < kMostSteps; ++step) {
    Eigen::VectorXd gradient(size);
    Eigen::MatrixXd curvature(size, size);
    const auto at = [&](Index i, double di, Index j, double dj) {
      Eigen::VectorXd moved = logs;
      moved(i) += di;
      moved(j) += dj;
      return fit.explained(moved);
    };
    for (Index i = 0; i < size; ++i) {
      const double up = at(i, h, i, 0), down = at(i, -h, i, 0);
      gradient(i) = (up - down) / (2 * h);
      curvature(i, i) = (up - 2 * value + down) / (h * h);
      for (Index j = 0; j < i; ++j)
        curvature(i, j) = curvature(j, i) =
            (at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h)) / (4 * h * h);
    }
    if (!gradient.allFinite() || !curvature.allFinite()) return logs;
    bool better = false;
    for (int trial = 0; trial < 12 && !better; ++trial, damping *= 10) {
      // Uphill also where the curvature is not that of a hill.
      Eigen::MatrixXd hill = -curvature;
      hill.diagonal() = hill.diagonal().cwiseAbs() * (1 + damping);
      const Eigen::VectorXd move = hill.ldlt().solve(gradient);
      if (!move.allFinite()) continue;
      const double reached = fit.explained(logs + move);
      if (!(reached > value)) continue;
      better = true;
      logs += move;
      value = reached;
      damping /= 100;
      if (move.cwiseAbs().maxCoeff() < 1e-12) return logs;
    }
    if (!better) return logs;
  }
  return logs;
}

BackgroundModes optimized_modes(const SnapshotFactor<double>& factor, const DmdOptions& options) {
  BackgroundModes modes = reduced_qdmd(factor, options);
  const Index count = modes.eigenvalues.size(), m = factor.r.cols();
  if (count == 0) return modes;
  Eigen::VectorXd logs(4 * count);
  for (Index p = 0; p < count; ++p) {
    // A mode that is gone after a frame has no exponential.
    if (!(std::abs(modes.eigenvalues(p)) > 1e-3)) return modes;
    const Quaterniond b = modes.amplitudes.get(p, 0).unit();
    const Quaterniond start = b.conj() * log(Quaterniond(modes.eigenvalues(p))) * b;
    logs.segment<4>(4 * p) << start.w, start.x, start.y, start.z;
  }
  const ExponentialFit fit(factor.r);
  if (!(fit.explained(logs) >= 0)) return modes;
  logs = fitted(fit, logs, static_cast<double>(m));
  BackgroundModes result = modes;
  const auto coefficients = fit.coefficients(logs);
  result.combination = coefficients;
  for (Index p = 0; p < count; ++p) {
    const Quaterniond value = exp(ExponentialFit::log_of(logs, p));
    result.combination.scale_col(p, standardizing_rotation(value));
    result.eigenvalues(p) = {value.w, value.vector_norm()};
  }
  fit_to_window(&result, factor.r * result.combination, factor.r);
  const double residual = modes.summary.residual;
  describe_nearest(&result, residual);
  result.summary.estimator = Estimator::optimized;
  return checked(result, modes.summary.rank, modes.summary.condition).value_or(modes);
}

}  // namespace

BackgroundModes solve_factor(const SnapshotFactor<double>& factor, const DmdOptions& options) {
  if (options.estimator == Estimator::exact || factor.r.cols() < 2 || factor.r.rows() == 0)
    return reduced_qdmd(factor, options);
  if (options.estimator == Estimator::optimized) return optimized_modes(factor, options);
  DmdOptions low = options;
  low.rank = std::max(1, low.rank);
  auto modes = options.estimator == Estimator::forward_backward
                   ? forward_backward_modes(factor, low)
                   : total_modes(factor, low);
  if (!modes) return reduced_qdmd(factor, low);
  modes->summary.estimator = options.estimator;
  return *std::move(modes);
}

}  // namespace qdmd
