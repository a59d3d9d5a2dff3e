// SPDX-License-Identifier: LGPL-2.1-or-later
// Q-DMD (the paper's Algorithm 2) of a snapshot factor: the small problem after the pixels.
#pragma once

#include <optional>

#include "core/dmd/snapshot_factor.h"
#include "core/quaternion/arnoldi.h"
#include "core/quaternion/pencil.h"
#include "core/quaternion/schur.h"
#include "core/quaternion/svd.h"

namespace qdmd {
namespace internal {

template <typename Real>
QuaternionMatrix<Real> to_matrix(const std::vector<Quaternion<Real>>& column) {
  QuaternionMatrix<Real> m(static_cast<Eigen::Index>(column.size()), 1);
  for (Eigen::Index k = 0; k < m.rows(); ++k) m.set(k, 0, column[static_cast<size_t>(k)]);
  return m;
}

template <typename Real>
std::vector<Quaternion<Real>> to_column(const QuaternionMatrix<Real>& m) {
  std::vector<Quaternion<Real>> column(static_cast<size_t>(m.rows()));
  for (Eigen::Index k = 0; k < m.rows(); ++k) column[static_cast<size_t>(k)] = m.get(k, 0);
  return column;
}

// Puts the coefficients `lower` of [x_2 .. x_m] (m - 1 x 1) into mode p; x_1 has none.
template <typename Real>
void set_combination(QuaternionModes<Real>* modes, Eigen::Index p,
                     const QuaternionMatrix<Real>& lower) {
  modes->combination.a.col(p).tail(lower.rows()) = lower.a;
  modes->combination.b.col(p).tail(lower.rows()) = lower.b;
}

// The projected operator of Algorithm 2, step 2: Q~ = (X C)^H Y C for coefficients C (m - 1 x rank)
// that make X C orthonormal. C = V S^-1 in the paper; C = R11^-1 is a rotation of it.
template <typename Real>
struct Projection {
  QuaternionMatrix<Real> coefficients, q_tilde;
};

// The paper's amplitude of one mode without the others: b = (y w)^-1 y a for the left eigenvector y
// (a row) and the right one w in coordinates in which a = argmin |Y C a - x_1|. Empty where y and w
// are orthogonal to working accuracy, as those of a defective eigenvalue are.
template <typename Real>
std::optional<Quaternion<Real>> amplitude_from_left_vector(const QuaternionMatrix<Real>& y,
                                                           const QuaternionMatrix<Real>& w,
                                                           const QuaternionMatrix<Real>& a) {
  const Quaternion<Real> share = (y * w).get(0, 0);
  const Real limit =
      Real(50 * static_cast<double>(w.rows())) * std::numeric_limits<Real>::epsilon();
  if (!(share.norm() > limit * y.norm() * w.norm())) return std::nullopt;
  return share.inverse() * (y * a).get(0, 0);
}

// The nearest mode without the Schur form: of the Hessenberg pencil h, b, in whose coordinates C
// turns into `coefficients` (m - 1 x size). `first_frame`: argmin |Y C a - x_1| in the same
// coordinates, for Amplitude::first_frame only. Empty where the Schur form is needed.
template <typename Real>
std::optional<QuaternionModes<Real>> nearest_mode(const QuaternionMatrix<Real>& h,
                                                  const QuaternionMatrix<Real>& b,
                                                  const QuaternionMatrix<Real>* coefficients,
                                                  const QuaternionMatrix<Real>* first_frame,
                                                  const SnapshotFactor<Real>& factor) {
  const Pencil<Real> pencil(h, b);
  const auto pair = pencil.nearest();
  if (!pair) return std::nullopt;
  const auto v = to_matrix(pair->vector);
  QuaternionModes<Real> result(factor.r.cols(), 1);
  result.eigenvalues(0) = pair->value;
  set_combination(&result, 0, coefficients ? *coefficients * v : v);
  if (first_frame) {
    const auto u = pencil.left_vector(pair->value);
    if (!u) return std::nullopt;
    const auto amplitude =
        amplitude_from_left_vector<Real>(to_matrix(*u).conjugate_transpose() * b, v, *first_frame);
    if (!amplitude) return std::nullopt;
    result.amplitudes.set(0, 0, *amplitude);
  } else {
    fit_to_window(&result, factor.r * result.combination, factor.r);
  }
  describe_nearest(&result, pair->residual);
  result.selection.margin = static_cast<double>(pair->margin);
  result.selection.exact = pair->exact;
  return result;
}

// The mode nearest the origin for a projection, whose Q~ is reduced to Hessenberg form first.
template <typename Real>
std::optional<QuaternionModes<Real>> nearest_mode_of_projection(const Projection<Real>& projection,
                                                                const SnapshotFactor<Real>& factor,
                                                                Amplitude amplitude) {
  const Eigen::Index later = factor.r.cols() - 1, rank = projection.q_tilde.rows();
  QuaternionMatrix<Real> h = projection.q_tilde;
  const auto basis = reduce_to_hessenberg(h);
  const auto coefficients = projection.coefficients * basis;
  const auto identity = QuaternionMatrix<Real>::identity(rank);
  if (amplitude == Amplitude::window)
    return nearest_mode<Real>(h, identity, &coefficients, nullptr, factor);
  bool dependent = false;
  const auto a =
      least_squares<Real>(factor.r.right_cols(later) * coefficients, factor.r.col(0), &dependent);
  auto result = nearest_mode<Real>(h, identity, &coefficients, &a, factor);
  if (result) result->selection.dependent = dependent;
  return result;
}

// Of each of the eigenvectors `wanted` of another operator in the same coordinates: which one of
// `form` is most like it. None is taken twice.
template <typename Real>
std::vector<Eigen::Index> most_like(const SchurForm<Real>& form, const SchurForm<Real>& other,
                                    const std::vector<Eigen::Index>& wanted) {
  const auto vector = [](const SchurForm<Real>& of, Eigen::Index k) {
    return QuaternionMatrix<Real>(of.q * triangular_eigenvector(of.t, k));
  };
  std::vector<Eigen::Index> found;
  for (const Eigen::Index k : wanted) {
    const auto w = vector(other, k).conjugate_transpose();
    Eigen::Index best = -1;
    Real likeness = 0;
    for (Eigen::Index j = 0; j < form.t.rows(); ++j) {
      const auto v = vector(form, j);
      const Real like = (w * v).norm() / v.norm();
      if (std::find(found.begin(), found.end(), j) != found.end()) continue;
      if (best >= 0 && !(like > likeness)) continue;
      best = j;
      likeness = like;
    }
    found.push_back(best);
  }
  return found;
}

// All that is asked, from the Schur form of Q~ (Algorithm 2, step 3: Q~ W = W Lambda). Empty where
// the eigenvalue iteration does not end. decides: where given, the operator in the coordinates of
// Q~ whose eigenvalues say which modes are background; those of Q~ that are most like them are.
template <typename Real>
std::optional<QuaternionModes<Real>> modes_from_schur_form(
    const Projection<Real>& projection, const SnapshotFactor<Real>& factor,
    const DmdOptions& options, const QuaternionMatrix<Real>* decides = nullptr) {
  const Eigen::Index m = factor.r.cols(), rank = projection.q_tilde.rows();
  const auto form = schur(projection.q_tilde);
  if (!form.converged) return std::nullopt;
  const ComplexVector<Real> eigenvalues = form.eigenvalues();
  Selection selection;
  std::vector<Eigen::Index> chosen;
  if (decides) {
    const auto deciding = schur(*decides);
    if (!deciding.converged) return std::nullopt;
    chosen = most_like(form, deciding,
                       select_background<Real>(deciding.eigenvalues(), options.omega_threshold,
                                               options.max_modes, &selection));
  } else {
    chosen = select_background<Real>(eigenvalues, options.omega_threshold, options.max_modes,
                                     &selection);
  }
  const auto coefficients = projection.coefficients * form.q;

  // Algorithm 2, step 4: Phi = Y V S^-1 W, kept as coefficients of the snapshots.
  QuaternionModes<Real> result(m, static_cast<Eigen::Index>(chosen.size()));
  result.selection = selection;
  for (Eigen::Index p = 0; p < result.eigenvalues.size(); ++p) {
    const Eigen::Index k = chosen[static_cast<size_t>(p)];
    const auto w = triangular_eigenvector(form.t, k);
    result.eigenvalues(p) = eigenvalues(k);
    set_combination(&result, p, coefficients * w);
    if (p == 0)
      describe_nearest(&result,
                       eigenpair_residual<Real>(projection.q_tilde, form.q * w, eigenvalues(k)));
  }
  if (options.amplitude == Amplitude::window) {
    fit_to_window(&result, factor.r * result.combination, factor.r);
    return result;
  }
  if (chosen.size() == 1) {
    const auto a = least_squares<Real>(factor.r.right_cols(m - 1) * coefficients, factor.r.col(0),
                                       &result.selection.dependent);
    const auto b = amplitude_from_left_vector<Real>(triangular_left_eigenvector(form.t, chosen[0]),
                                                    triangular_eigenvector(form.t, chosen[0]), a);
    if (b) {
      result.amplitudes.set(0, 0, *b);
      return result;
    }
  }
  // Several modes that nearly coincide share the first snapshot: only together are they stable.
  QuaternionModes<Real> all(m, rank);
  for (Eigen::Index k = 0; k < rank; ++k)
    set_combination(&all, k, coefficients * triangular_eigenvector(form.t, k));
  const auto b =
      least_squares<Real>(factor.r * all.combination, factor.r.col(0), &result.selection.dependent);
  for (Eigen::Index p = 0; p < result.eigenvalues.size(); ++p)
    result.amplitudes.set(p, 0, b.get(chosen[static_cast<size_t>(p)], 0));
  return result;
}

// The nearest mode at full rank, from the Hessenberg pencil H v = R11 v lambda: no inverse, no
// singular values. Empty where it takes more than that.
template <typename Real>
std::optional<QuaternionModes<Real>> nearest_mode_of_pencil(const QuaternionMatrix<Real>& h,
                                                            const QuaternionMatrix<Real>& r11,
                                                            const SnapshotFactor<Real>& factor,
                                                            Amplitude amplitude) {
  if (amplitude == Amplitude::window) return nearest_mode<Real>(h, r11, nullptr, nullptr, factor);
  // Y is Hessenberg in these coordinates. Dependent snapshots x_2 .. x_m want least norm.
  const HessenbergQr<Real> later(factor.r.right_cols(h.cols()));
  if (!(later.smallest_pivot() > factor.tolerance * factor.r.norm())) return std::nullopt;
  const auto a = to_matrix(later.solve(to_column(factor.r.col(0))));
  return nearest_mode<Real>(h, r11, nullptr, &a, factor);
}

template <typename Real>
std::optional<QuaternionModes<Real>> full_rank_modes(const SnapshotFactor<Real>& factor,
                                                     const DmdOptions& options) {
  const Eigen::Index past = factor.r.cols() - 1;
  auto r11 = factor.r.block(0, 0, past, past);
  const Real condition = condition_estimate(ScalarGrid<Real>(r11));
  if (!(condition * factor.tolerance < Real(1))) return std::nullopt;
  auto h = factor.r.block(0, 1, past, past);
  std::optional<QuaternionModes<Real>> result;
  if (!(options.omega_threshold > 0))
    result = nearest_mode_of_pencil(h, r11, factor, options.amplitude);
  if (!result) {
    Projection<Real> projection;
    projection.coefficients = solve_upper(r11, QuaternionMatrix<Real>::identity(past));
    r11 = {};  // memory for what comes
    projection.q_tilde = h * projection.coefficients;
    h = {};
    result = modes_from_schur_form(projection, factor, options);
    if (result) result->selection.operator_size = static_cast<double>(projection.q_tilde.norm());
  }
  if (!result || !result->combination.all_finite() || !result->amplitudes.all_finite())
    return std::nullopt;
  result->summary.rank = static_cast<int>(past);
  result->summary.condition = static_cast<double>(condition);
  return result;
}

// Algorithm 2, step 1, without pixels: singular values of X and the coefficients V S^-1, and U^H
// for step 2.
template <typename Real>
struct PastSpectrum {
  Eigen::Matrix<Real, Eigen::Dynamic, 1> sigma;
  QuaternionMatrix<Real> u, v_over_s;
};

// The largest singular value alone, with its vector: in frames of one scene it stands out so far
// that a few steps of Arnoldi's method (Lanczos's, since X X^H is Hermitian) find it. Empty where
// they do not.
template <typename Real>
std::optional<PastSpectrum<Real>> leading_spectrum(const QuaternionMatrix<Real>& past) {
  constexpr Eigen::Index kMostSteps = 24;
  using std::sqrt;
  const auto past_h = past.conjugate_transpose();
  const auto apply = [&](const std::vector<Quaternion<Real>>& v) {
    return to_column<Real>(past * (past_h * to_matrix(v)));
  };
  Arnoldi<Real, decltype(apply)> space(apply, past.rows());
  while (space.dimension() < kMostSteps && !space.complete()) {
    if (!space.step()) return std::nullopt;
    const auto ritz = space.ritz();
    if (!ritz.converged) return std::nullopt;
    const Real value = ritz.values[0].real();
    if (!(value > Real(0))) return std::nullopt;
    if (ritz.residuals[0] > std::numeric_limits<Real>::epsilon() * value) continue;
    PastSpectrum<Real> result;
    result.sigma.resize(1);
    result.sigma(0) = sqrt(value);
    result.u = to_matrix(space.combine(ritz.coordinates[0]));
    return result;
  }
  return std::nullopt;
}

template <typename Real>
PastSpectrum<Real> past_spectrum(const SnapshotFactor<Real>& factor, Eigen::Index limit) {
  const auto past = factor.r.left_cols(factor.r.cols() - 1);
  if (limit == 1) {
    if (auto leading = leading_spectrum<Real>(past)) {
      leading->v_over_s = past.conjugate_transpose() *
                          leading->u.scale_cols(leading->sigma.cwiseInverse().cwiseAbs2().eval());
      return *std::move(leading);
    }
  }
  PastSpectrum<Real> result;
  Eigen::Matrix<Real, Eigen::Dynamic, 1> values;
  QuaternionMatrix<Real> u;
  if (factor.squared) {
    // X X^H in the basis of R.
    auto eigen = hermitian_eigen(past * past.conjugate_transpose());
    values = eigen.values.cwiseMax(Real(0)).cwiseSqrt();
    u = std::move(eigen.vectors);
  } else {
    auto singular = svd(past);
    values = std::move(singular.values);
    u = std::move(singular.u);
  }
  Eigen::Index rank = 0;
  while (rank < values.size() && values(rank) > factor.tolerance * values(0)) ++rank;
  if (limit > 0) rank = std::min(rank, limit);
  result.sigma = values.head(rank);
  result.u = u.left_cols(rank);
  // V S^-1 = X^H U S^-2: in the row space of X to within one product's rounding, which V of a long
  // window's decomposition is not.
  const Eigen::Matrix<Real, Eigen::Dynamic, 1> inverse = result.sigma.cwiseInverse().cwiseAbs2();
  result.v_over_s = past.conjugate_transpose() * result.u.scale_cols(inverse);
  return result;
}

template <typename Real>
QuaternionModes<Real> projected_modes(const SnapshotFactor<Real>& factor,
                                      const DmdOptions& options) {
  const Eigen::Index m = factor.r.cols();
  QuaternionModes<Real> none(m);
  if (factor.r.rows() == 0) return none;
  for (Eigen::Index limit : {Eigen::Index{options.rank}, Eigen::Index{1}}) {
    const auto spectrum = past_spectrum(factor, limit);
    const Eigen::Index rank = spectrum.sigma.size();
    if (rank == 0) return none;
    const Projection<Real> projection{
        spectrum.v_over_s,
        spectrum.u.conjugate_transpose() * (factor.r.right_cols(m - 1) * spectrum.v_over_s)};
    std::optional<QuaternionModes<Real>> result;
    if (!(options.omega_threshold > 0))
      result = nearest_mode_of_projection(projection, factor, options.amplitude);
    if (!result) result = modes_from_schur_form(projection, factor, options);
    if (!result) {
      // Nothing is known to bring this about; rank one needs no iteration.
      none.summary.converged = false;
      continue;
    }
    result->selection.operator_size = static_cast<double>(projection.q_tilde.norm());
    result->summary.converged = none.summary.converged;
    result->summary.rank = static_cast<int>(rank);
    result->summary.condition = static_cast<double>(spectrum.sigma(0) / spectrum.sigma(rank - 1));
    return *std::move(result);
  }
  return none;
}

}  // namespace internal

// The background modes of the snapshots that `factor` stands for. Fewer than two snapshots and
// X = 0 have no mode (P = 0).
template <typename Real>
QuaternionModes<Real> reduced_qdmd(const SnapshotFactor<Real>& factor, const DmdOptions& options) {
  const Eigen::Index m = factor.r.cols();
  if (m < 2) return QuaternionModes<Real>(m);
  if (factor.triangular && factor.r.rows() >= m - 1 &&
      (options.rank == 0 || options.rank >= m - 1)) {
    if (auto result = internal::full_rank_modes(factor, options)) return *std::move(result);
  }
  return internal::projected_modes(factor, options);
}

// In double they are compiled once.
extern template QuaternionModes<double> reduced_qdmd(const SnapshotFactor<double>&,
                                                     const DmdOptions&);
namespace internal {
extern template std::optional<QuaternionModes<double>> modes_from_schur_form(
    const Projection<double>&, const SnapshotFactor<double>&, const DmdOptions&,
    const QuaternionMatrix<double>*);
extern template PastSpectrum<double> past_spectrum(const SnapshotFactor<double>&, Eigen::Index);
}  // namespace internal

}  // namespace qdmd
