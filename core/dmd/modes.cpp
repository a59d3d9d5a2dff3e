#include "core/dmd/modes.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/dmd/temporal_model.h"
#include "core/quaternion/hermitian.h"

namespace qdmd {

double omega_magnitude(std::complex<double> lambda) {
  const double size = std::abs(lambda);
  if (size == 0) return std::numeric_limits<double>::infinity();
  return std::hypot(std::log(size), std::arg(lambda));
}

std::vector<Eigen::Index> select_background(const Eigen::VectorXcd& eigenvalues, double threshold) {
  std::vector<Eigen::Index> order(static_cast<size_t>(eigenvalues.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index l, Eigen::Index r) {
    return omega_magnitude(eigenvalues(l)) < omega_magnitude(eigenvalues(r));
  });
  // Threshold 0 asks for one mode, even where several are exactly static.
  size_t count = 0;
  while (threshold > 0 && count < order.size() &&
         omega_magnitude(eigenvalues(order[count])) <= threshold)
    ++count;
  order.resize(std::min(order.size(), std::max<size_t>(count, 1)));
  return order;
}

double gram_tolerance(Eigen::Index size) {
  return 4 * static_cast<double>(size) * std::numeric_limits<double>::epsilon();
}

double fit_reference_time(std::complex<double> lambda, Eigen::Index snapshots) {
  return std::abs(lambda) > 1 ? static_cast<double>(snapshots - 1) : 0;
}

QuaternionMatrixd fit_window_amplitudes(const Eigen::VectorXcd& eigenvalues,
                                        const Eigen::VectorXd& reference_times,
                                        const QuaternionMatrixd& phi_phi,
                                        const QuaternionMatrixd& phi_x) {
  const Eigen::Index modes = eigenvalues.size(), snapshots = phi_x.cols();
  // powers(p, t) = lambda_p^(t - reference_p).
  Eigen::MatrixXcd powers(modes, snapshots);
  for (Eigen::Index p = 0; p < modes; ++p)
    for (Eigen::Index t = 0; t < snapshots; ++t)
      powers(p, t) = power(eigenvalues(p), static_cast<double>(t) - reference_times(p));

  // Normal equations N b = c with N_pq = sum_t conj(l_p^t) (Phi^H Phi)_pq l_q^t and
  // c_p = sum_t conj(l_p^t) (Phi^H x_t)_p; l j = j conj(l) moves powers past the j part.
  QuaternionMatrixd normal(modes, modes), rhs(modes, 1);
  const Eigen::MatrixXcd direct = powers.conjugate() * powers.transpose();
  const Eigen::MatrixXcd crossed = powers.conjugate() * powers.adjoint();
  normal.a = phi_phi.a.cwiseProduct(direct);
  normal.b = phi_phi.b.cwiseProduct(crossed);
  rhs.a = powers.conjugate().cwiseProduct(phi_x.a).rowwise().sum();
  rhs.b = powers.conjugate().cwiseProduct(phi_x.b).rowwise().sum();

  // Unit diagonal first: modes and their powers differ in size by orders of magnitude.
  Eigen::VectorXd scale(modes);
  for (Eigen::Index p = 0; p < modes; ++p) {
    const double d = normal.a(p, p).real();
    scale(p) = d > 0 ? 1 / std::sqrt(d) : 0;
  }
  const Eigen::VectorXcd s = scale.cast<std::complex<double>>();
  normal.a = (s.asDiagonal() * normal.a * s.asDiagonal()).eval();
  normal.b = (s.asDiagonal() * normal.b * s.asDiagonal()).eval();
  rhs.a = (s.asDiagonal() * rhs.a).eval();
  rhs.b = (s.asDiagonal() * rhs.b).eval();
  const auto eigen = hermitian_eigen(normal);
  const double tolerance =
      4 * static_cast<double>(modes) * std::numeric_limits<double>::epsilon() * eigen.values(0);
  const Eigen::VectorXd inverse =
      eigen.values.unaryExpr([&](double v) { return v > tolerance && v > 0 ? 1 / v : 0.0; });
  QuaternionMatrixd b =
      eigen.vectors.scale_cols(inverse) * (eigen.vectors.conjugate_transpose() * rhs);
  b.a = (s.asDiagonal() * b.a).eval();
  b.b = (s.asDiagonal() * b.b).eval();
  return b;
}

void fit_to_window(BackgroundModes* modes, const QuaternionMatrixd& phi,
                   const QuaternionMatrixd& x) {
  for (Eigen::Index p = 0; p < modes->eigenvalues.size(); ++p)
    modes->reference_times(p) = fit_reference_time(modes->eigenvalues(p), x.cols());
  const auto phi_h = phi.conjugate_transpose();
  modes->amplitudes =
      fit_window_amplitudes(modes->eigenvalues, modes->reference_times, phi_h * phi, phi_h * x);
}

void describe_nearest(BackgroundModes* modes, const QuaternionMatrixd& q_tilde,
                      const QuaternionMatrixd& vector) {
  DmdSummary& summary = modes->summary;
  summary.background_modes = static_cast<int>(modes->eigenvalues.size());
  summary.lambda = modes->eigenvalues(0);
  summary.omega = omega_magnitude(summary.lambda);
  QuaternionMatrixd scaled = vector;
  scaled.scale_col(0, Quaterniond(summary.lambda));
  const double size = q_tilde.norm() * vector.norm();
  summary.residual = size > 0 ? (q_tilde * vector - scaled).norm() / size : 0;
}

QuaternionMatrixd first_frame_amplitudes(const QuaternionMatrixd& phi, const QuaternionMatrixd& x) {
  // Unit columns first, so that small modes are not taken for dependent ones.
  const Eigen::VectorXd size =
      (phi.a.colwise().squaredNorm() + phi.b.colwise().squaredNorm()).cwiseSqrt();
  const Eigen::VectorXd scale = size.unaryExpr([](double v) { return v > 0 ? 1 / v : 0.0; });
  const Eigen::MatrixXcd chi = phi.scale_cols(scale).adjoint();
  Eigen::MatrixXcd rhs(2 * x.rows(), 1);
  rhs << x.a, -x.b.conjugate();
  const Eigen::MatrixXcd solution = chi.completeOrthogonalDecomposition().solve(rhs);
  QuaternionMatrixd b = QuaternionMatrixd::from_adjoint_columns(solution);
  const Eigen::VectorXcd s = scale.cast<std::complex<double>>();
  b.a = (s.asDiagonal() * b.a).eval();
  b.b = (s.asDiagonal() * b.b).eval();
  return b;
}

}  // namespace qdmd
