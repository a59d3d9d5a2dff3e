// SPDX-License-Identifier: LGPL-2.1-or-later
// What all decompositions share: choosing the background modes and fitting their amplitudes.
// Templates on the real type, so that tests can run the same algorithm in 50 digits.
#pragma once

#include <Eigen/QR>
#include <algorithm>
#include <numeric>

#include "core/dmd/options.h"
#include "core/dmd/temporal_model.h"
#include "core/quaternion/hermitian.h"

namespace qdmd {

template <typename Real>
using ComplexVector = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1>;

// How clear it was which modes are background.
struct Selection {
  // How much nearer to the origin, in rad/frame, the chosen modes are than the next one, or than
  // the threshold; infinite where there is no other.
  double margin = std::numeric_limits<double>::infinity();
  // False: a bound from below, since not all modes were computed.
  bool exact = true;
  // Modes depend on each other to within rounding: a tolerance decided how they share what they
  // have in common.
  bool dependent = false;
  // |Q~| where the modes are those of a projected operator, whose rounding has its size; else one.
  double operator_size = 1;
};

// The background part of a quaternion decomposition of m snapshots, P modes:
// L(t) = sum_p X combination_p lambda_p^(t - reference_time_p) amplitude_p, X = [x_1 .. x_m].
template <typename Real>
struct QuaternionModes {
  ComplexVector<Real> eigenvalues;     // P, imaginary parts >= 0
  QuaternionMatrix<Real> combination;  // m x P
  QuaternionMatrix<Real> amplitudes;   // P x 1
  Eigen::VectorXd reference_times;     // P, frames
  Selection selection;
  DmdSummary summary;

  QuaternionModes() = default;
  // No mode: the background of a window that is zero, or of one snapshot.
  explicit QuaternionModes(Eigen::Index snapshots) : combination(snapshots, 0), amplitudes(0, 1) {}
  // All zero.
  QuaternionModes(Eigen::Index snapshots, Eigen::Index modes)
      : eigenvalues(ComplexVector<Real>::Zero(modes)),
        combination(snapshots, modes),
        amplitudes(modes, 1),
        reference_times(Eigen::VectorXd::Zero(modes)) {}
};
using BackgroundModes = QuaternionModes<double>;

// |omega| = |ln lambda| in rad/frame, the paper's omega = ln(lambda) / dt with the frame as dt;
// infinity for lambda = 0.
template <typename Real>
Real omega_magnitude(const std::complex<Real>& lambda) {
  return log(Quaternion<Real>(lambda)).norm();
}

// Indices of the background modes, those with |omega_p| ~ 0 of the paper's separation ("sepmet"),
// nearest to the origin first: all with |omega| <= threshold, or
// the nearest one where none is (or threshold is 0), at most `limit` (0: any number). Equal
// distances keep their order. Empty only for no eigenvalues.
template <typename Real>
std::vector<Eigen::Index> select_background(const ComplexVector<Real>& eigenvalues,
                                            double threshold, int limit = 0,
                                            Selection* selection = nullptr) {
  std::vector<Real> omega(static_cast<size_t>(eigenvalues.size()));
  for (size_t k = 0; k < omega.size(); ++k)
    omega[k] = omega_magnitude(eigenvalues(static_cast<Eigen::Index>(k)));
  std::vector<Eigen::Index> order(omega.size());
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const auto omega_of = [&](Eigen::Index k) -> const Real& {
    return omega[static_cast<size_t>(k)];
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index l, Eigen::Index r) { return omega_of(l) < omega_of(r); });
  // Threshold 0 asks for one mode, even where several are exactly static.
  size_t count = 0;
  while (threshold > 0 && count < order.size() && omega_of(order[count]) <= Real(threshold))
    ++count;
  if (limit > 0) count = std::min(count, static_cast<size_t>(limit));
  count = std::min(order.size(), std::max<size_t>(count, 1));
  if (selection) {
    *selection = {};
    const auto distance = [&](size_t k) { return static_cast<double>(omega_of(order[k])); };
    // Several infinite ones are as far as one another.
    const auto less = [](double from, double by) { return by < from ? from - by : 0.0; };
    if (count < order.size()) selection->margin = less(distance(count), distance(count - 1));
    // The threshold decided, and not the limit.
    if (threshold > 0 && count > 0 && distance(count - 1) <= threshold) {
      const bool limited = limit > 0 && count == static_cast<size_t>(limit);
      const double inside = threshold - distance(count - 1);
      const double outside = count < order.size() && !limited
                                 ? distance(count) - threshold
                                 : std::numeric_limits<double>::infinity();
      selection->margin = limited ? selection->margin : std::min(inside, outside);
    } else if (threshold > 0 && count > 0) {
      selection->margin = std::min(selection->margin, distance(0) - threshold);
    }
  }
  order.resize(count);
  return order;
}

// The frame at which lambda^(t - reference) is one for amplitudes that are fitted to m snapshots:
// the last one for growing modes, so that no power exceeds one inside the window.
template <typename Real>
double fit_reference_time(const std::complex<Real>& lambda, Eigen::Index snapshots) {
  return Quaternion<Real>(lambda).norm() > Real(1) ? static_cast<double>(snapshots - 1) : 0;
}

// Rounding's relative error in the eigenvalues of an exact m x m Gram matrix: eigenvalues below
// this times the largest count as zero, that is singular values below its square root.
template <typename Real = double>
Real gram_tolerance(Eigen::Index size) {
  return Real(4 * static_cast<double>(size)) * std::numeric_limits<Real>::epsilon();
}

namespace internal {

template <typename Real, typename Scale>
void scale_rows(QuaternionMatrix<Real>& m, const Scale& scale) {
  for (Eigen::Index r = 0; r < m.rows(); ++r) {
    m.a.row(r) *= scale(r);
    m.b.row(r) *= scale(r);
  }
}

}  // namespace internal

// Amplitudes b (P x 1) that minimize sum_t |x_t - sum_p phi_p lambda_p^(t - reference_p) b_p|^2.
// phi_phi = Phi^H Phi (P x P), phi_x = Phi^H [x_1 .. x_m] (P x m). Dependent modes share the
// minimum-norm solution, and `dependent` is set.
template <typename Real>
QuaternionMatrix<Real> fit_window_amplitudes(const ComplexVector<Real>& eigenvalues,
                                             const Eigen::VectorXd& reference_times,
                                             const QuaternionMatrix<Real>& phi_phi,
                                             const QuaternionMatrix<Real>& phi_x,
                                             bool* dependent = nullptr) {
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  using ComplexMatrix = typename QuaternionMatrix<Real>::ComplexMatrix;
  using std::sqrt;
  const Eigen::Index modes = eigenvalues.size(), snapshots = phi_x.cols();
  // powers(p, t) = lambda_p^(t - reference_p).
  ComplexMatrix powers(modes, snapshots);
  for (Eigen::Index p = 0; p < modes; ++p)
    for (Eigen::Index t = 0; t < snapshots; ++t)
      powers(p, t) = power<Real>(eigenvalues(p), static_cast<double>(t) - reference_times(p));

  // Normal equations N b = c with N_pq = sum_t conj(l_p^t) (Phi^H Phi)_pq l_q^t and
  // c_p = sum_t conj(l_p^t) (Phi^H x_t)_p; l j = j conj(l) moves powers past the j part.
  QuaternionMatrix<Real> normal(modes, modes), rhs(modes, 1);
  const ComplexMatrix direct = powers.conjugate() * powers.transpose();
  const ComplexMatrix crossed = powers.conjugate() * powers.adjoint();
  normal.a = phi_phi.a.cwiseProduct(direct);
  normal.b = phi_phi.b.cwiseProduct(crossed);
  rhs.a = powers.conjugate().cwiseProduct(phi_x.a).rowwise().sum();
  rhs.b = powers.conjugate().cwiseProduct(phi_x.b).rowwise().sum();

  // Unit diagonal first: modes and their powers differ in size by orders of magnitude.
  Vector scale(modes);
  for (Eigen::Index p = 0; p < modes; ++p) {
    const Real d = normal.a(p, p).real();
    scale(p) = d > Real(0) ? Real(Real(1) / sqrt(d)) : Real(0);
  }
  internal::scale_rows(normal, scale);
  normal = normal.scale_cols(scale);
  internal::scale_rows(rhs, scale);
  const auto eigen = hermitian_eigen(normal);
  const Real tolerance = gram_tolerance<Real>(modes) * eigen.values(0);
  const Vector inverse = eigen.values.unaryExpr(
      [&](const Real& v) { return v > tolerance && v > Real(0) ? Real(Real(1) / v) : Real(0); });
  // Normal equations square how dependent modes are: half of the digits is what they may cost.
  if (dependent)
    *dependent = modes > 1 && !(eigen.values(modes - 1) >
                                sqrt(std::numeric_limits<Real>::epsilon()) * eigen.values(0));
  QuaternionMatrix<Real> b =
      eigen.vectors.scale_cols(inverse) * (eigen.vectors.conjugate_transpose() * rhs);
  internal::scale_rows(b, scale);
  return b;
}

// Sets reference times and window amplitudes of `modes` for its eigenvalues. phi: k x P, x: k x m,
// pixels or columns with the pixels' inner products.
template <typename Real>
void fit_to_window(QuaternionModes<Real>* modes, const QuaternionMatrix<Real>& phi,
                   const QuaternionMatrix<Real>& x) {
  for (Eigen::Index p = 0; p < modes->eigenvalues.size(); ++p)
    modes->reference_times(p) = fit_reference_time(modes->eigenvalues(p), x.cols());
  const auto phi_h = phi.conjugate_transpose();
  modes->amplitudes =
      fit_window_amplitudes<Real>(modes->eigenvalues, modes->reference_times, phi_h * phi,
                                  phi_h * x, &modes->selection.dependent);
}

// The b (r x 1) that minimizes |M b - x|, the one of least norm among equals: QR factorization with
// column pivoting of the complex adjoint, columns scaled to norm one. M: k x r, x: k x 1. With the
// modes Phi for M and the first snapshot for x these are the paper's amplitudes b = Phi^+ x_1.
// `dependent` is set where rounding may have decided what is dependent.
template <typename Real>
QuaternionMatrix<Real> least_squares(const QuaternionMatrix<Real>& m,
                                     const QuaternionMatrix<Real>& x, bool* dependent = nullptr) {
  using std::sqrt;
  // Unit columns first, so that small modes are not taken for dependent ones.
  Eigen::Matrix<Real, Eigen::Dynamic, 1> scale(m.cols());
  for (Eigen::Index p = 0; p < m.cols(); ++p) {
    const Real size = m.col(p).norm();
    scale(p) = size > Real(0) ? Real(Real(1) / size) : Real(0);
  }
  const auto chi = m.scale_cols(scale).adjoint();
  typename QuaternionMatrix<Real>::ComplexMatrix rhs(2 * x.rows(), 1);
  rhs << x.a, -x.b.conjugate();
  const auto factors = chi.completeOrthogonalDecomposition();
  const typename QuaternionMatrix<Real>::ComplexMatrix solution = factors.solve(rhs);
  if (dependent) {
    // Columns that are rounding beside the others, or become so once these are taken away.
    const Real half = sqrt(std::numeric_limits<Real>::epsilon());
    const auto pivots = factors.matrixQTZ().diagonal().cwiseAbs().eval();
    *dependent = chi.cols() > 2 && (!(pivots.minCoeff() > half * pivots.maxCoeff()) ||
                                    !(scale.minCoeff() > half * scale.maxCoeff()));
  }
  auto b = QuaternionMatrix<Real>::from_adjoint_columns(solution);
  internal::scale_rows(b, scale);
  return b;
}

// Fills in the summary's facts about the first of `modes`. `residual` as in DmdSummary.
template <typename Real>
void describe_nearest(QuaternionModes<Real>* modes, const Real& residual) {
  DmdSummary& summary = modes->summary;
  const std::complex<Real> lambda = modes->eigenvalues(0);
  summary.background_modes = static_cast<int>(modes->eigenvalues.size());
  summary.lambda = {static_cast<double>(lambda.real()), static_cast<double>(lambda.imag())};
  summary.omega = static_cast<double>(omega_magnitude(lambda));
  summary.residual = static_cast<double>(residual);
}

// |Q~ w - w lambda| / (|Q~| |w|) for a right eigenvector w (rank x 1) of q_tilde; 0 for Q~ = 0.
template <typename Real>
Real eigenpair_residual(const QuaternionMatrix<Real>& q_tilde, const QuaternionMatrix<Real>& w,
                        const std::complex<Real>& lambda) {
  auto scaled = w;
  scaled.scale_col(0, Quaternion<Real>(lambda));
  const Real size = q_tilde.norm() * w.norm();
  return size > Real(0) ? Real((q_tilde * w - scaled).norm() / size) : Real(0);
}

// In double they are compiled once, in modes.cpp.
extern template QuaternionMatrixd fit_window_amplitudes(const ComplexVector<double>&,
                                                        const Eigen::VectorXd&,
                                                        const QuaternionMatrixd&,
                                                        const QuaternionMatrixd&, bool*);
extern template QuaternionMatrixd least_squares(const QuaternionMatrixd&, const QuaternionMatrixd&,
                                                bool*);

}  // namespace qdmd
