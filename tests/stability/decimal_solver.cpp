// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/stability/decimal_solver.h"

#include <random>

namespace qdmd::stability {
namespace {

QuaternionMatrix<Decimal> to_decimal(const QuaternionMatrixd& m) {
  const auto convert = [](const std::complex<double>& c) {
    return std::complex<Decimal>(Decimal(c.real()), Decimal(c.imag()));
  };
  return {m.a.unaryExpr(convert), m.b.unaryExpr(convert)};
}

std::complex<Decimal> to_decimal(const std::complex<double>& c) {
  return {Decimal(c.real()), Decimal(c.imag())};
}

// lambda_p^(t - reference_p)
Quaternion<Decimal> growth(const QuaternionModes<Decimal>& modes, Eigen::Index p, Eigen::Index t) {
  return Quaternion<Decimal>(
      power<Decimal>(modes.eigenvalues(p), static_cast<double>(t) - modes.reference_times(p)));
}

// The coefficients of the snapshots in L(t), m x 1.
QuaternionMatrix<Decimal> shares_at(const QuaternionModes<Decimal>& modes, Eigen::Index t) {
  QuaternionMatrix<Decimal> shares(modes.combination.rows(), 1);
  for (Eigen::Index p = 0; p < modes.eigenvalues.size(); ++p) {
    auto mode = modes.combination.col(p);
    mode.scale_col(0, growth(modes, p, t) * modes.amplitudes.get(p, 0));
    shares += mode;
  }
  return shares;
}

}  // namespace

DecimalSolver::DecimalSolver(const IntegerMatrix& gram, Eigen::MatrixXd pixels)
    : factor_(factorize_gram(to_decimal(quaternion_gram(gram)))), pixels_(std::move(pixels)) {}

Answer DecimalSolver::solve(const DmdOptions& options) const {
  return evaluate(reduced_qdmd(factor_, options));
}

Answer DecimalSolver::solve_perturbed(const DmdOptions& options, double size, unsigned seed) const {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  SnapshotFactor<Decimal> perturbed = factor_;
  const Eigen::Index rows = factor_.r.rows(), cols = factor_.r.cols();
  Decimal longest(0);
  for (Eigen::Index c = 0; c < cols; ++c) longest = std::max(longest, factor_.r.col(c).norm());
  for (Eigen::Index c = 0; c < cols; ++c) {
    QuaternionMatrix<Decimal> direction(rows, 1);
    for (Eigen::Index r = 0; r < rows; ++r)
      direction.set(
          r, 0,
          {Decimal(normal(rng)), Decimal(normal(rng)), Decimal(normal(rng)), Decimal(normal(rng))});
    const Decimal length = direction.norm();
    if (!(length > Decimal(0))) continue;
    const Decimal scale = longest * Decimal(size) / length;
    perturbed.r.a.col(c) += direction.a * scale;
    perturbed.r.b.col(c) += direction.b * scale;
  }
  if (factor_.triangular) perturbed.r = qr(perturbed.r, false).r;
  return evaluate(reduced_qdmd(perturbed, options));
}

std::vector<double> DecimalSolver::singular_values() const {
  if (factor_.r.cols() < 2) return {};
  const auto past = factor_.r.left_cols(factor_.r.cols() - 1);
  const auto eigen = hermitian_eigen(past * past.conjugate_transpose());
  std::vector<double> values;
  for (Eigen::Index k = 0; k < eigen.values.size(); ++k)
    if (eigen.values(k) > factor_.tolerance * factor_.tolerance * eigen.values(0))
      values.push_back(static_cast<double>(sqrt(eigen.values(k))));
  return values;
}

Answer DecimalSolver::answer(const QuaternionModes<double>& modes) const {
  QuaternionModes<Decimal> wide;
  wide.eigenvalues.resize(modes.eigenvalues.size());
  for (Eigen::Index p = 0; p < wide.eigenvalues.size(); ++p)
    wide.eigenvalues(p) = to_decimal(modes.eigenvalues(p));
  wide.combination = to_decimal(modes.combination);
  wide.amplitudes = to_decimal(modes.amplitudes);
  wide.reference_times = modes.reference_times;
  wide.summary = modes.summary;
  return evaluate(wide);
}

Answer DecimalSolver::evaluate(const QuaternionModes<Decimal>& modes) const {
  const Eigen::Index m = factor_.r.cols(), probes = pixels_.rows() / 3;
  Answer answer;
  answer.rank = modes.summary.rank;
  answer.converged = modes.summary.converged;
  answer.modes = static_cast<int>(modes.eigenvalues.size());
  if (answer.modes > 0) answer.lambda = modes.eigenvalues(0);
  Decimal largest_sum(1), largest_part(1);
  for (Eigen::Index t : {Eigen::Index{0}, m / 2, m - 1}) {
    const auto shares = shares_at(modes, t);
    for (Eigen::Index p = 0; p < probes; ++p) {
      Quaternion<Decimal> sum;
      Decimal absolute(0);
      for (Eigen::Index s = 0; s < m; ++s) {
        const auto term =
            Quaternion<Decimal>(Decimal(0), Decimal(pixels_(3 * p, s)),
                                Decimal(pixels_(3 * p + 1, s)), Decimal(pixels_(3 * p + 2, s))) *
            shares.get(s, 0);
        sum += term;
        absolute += term.norm();
      }
      largest_sum = std::max(largest_sum, absolute);
      for (const Decimal& part : {sum.x, sum.y, sum.z}) {
        largest_part = std::max(largest_part, Decimal(abs(part)));
        answer.background.push_back(part);
      }
    }
  }
  answer.cancellation = static_cast<double>(largest_sum / largest_part);
  const auto phi = factor_.r * modes.combination;
  Decimal squared_error(0), squared(0);
  for (Eigen::Index t = 0; t < m; ++t) {
    auto error = factor_.r.col(t);
    for (Eigen::Index p = 0; p < modes.eigenvalues.size(); ++p) {
      auto mode = phi.col(p);
      mode.scale_col(0, growth(modes, p, t) * modes.amplitudes.get(p, 0));
      error -= mode;
    }
    squared_error += error.squared_norm();
    squared += factor_.r.col(t).squared_norm();
  }
  if (squared > Decimal(0)) answer.fit = static_cast<double>(sqrt(squared_error / squared));
  return answer;
}

Distance distance(const Answer& reference, const Answer& other) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if ((reference.modes == 0) != (other.modes == 0)) return {kInfinity, kInfinity};
  const auto magnitude = [](const std::complex<Decimal>& c) {
    return Quaternion<Decimal>(c).norm();
  };
  Distance result;
  result.lambda = static_cast<double>(magnitude(reference.lambda - other.lambda) /
                                      std::max(Decimal(1), magnitude(reference.lambda)));
  Decimal scale(1), largest(0);
  for (size_t i = 0; i < reference.background.size(); ++i) {
    scale = std::max(scale, Decimal(abs(reference.background[i])));
    const Decimal error = abs(reference.background[i] - other.background[i]);
    // What is not a number must not lose the comparison.
    if (!(error <= largest)) largest = error;
  }
  result.background = static_cast<double>(largest / scale);
  if (!(result.lambda >= 0)) result.lambda = kInfinity;
  if (!(result.background >= 0)) result.background = kInfinity;
  return result;
}

}  // namespace qdmd::stability
