// Q-DMD (the paper's Algorithm 2) of a snapshot factor: the small problem after the pixels.
#pragma once

#include <optional>

#include "core/dmd/snapshot_factor.h"
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

// The projected operator: Q~ = (X C)^H Y C for coefficients C (m - 1 x rank) that make X C
// orthonormal. C = V S^-1 in the paper; C = R11^-1 is a rotation of it.
template <typename Real>
struct Projection {
  QuaternionMatrix<Real> coefficients, q_tilde;
};

// One mode for amplitude=window, without the other eigenvectors. Empty where the Schur form is
// needed.
template <typename Real>
std::optional<QuaternionModes<Real>> nearest_mode(const Projection<Real>& projection,
                                                  const SnapshotFactor<Real>& factor) {
  const Eigen::Index m = factor.r.cols(), rank = projection.q_tilde.rows();
  QuaternionMatrix<Real> h = projection.q_tilde;
  const auto basis = reduce_to_hessenberg(h);
  const Pencil<Real> pencil(h, QuaternionMatrix<Real>::identity(rank));
  const auto pair = pencil.nearest();
  if (!pair) return std::nullopt;
  const auto w = basis * to_matrix(pair->vector);
  QuaternionModes<Real> result(m, 1);
  result.eigenvalues(0) = pair->value;
  set_combination(&result, 0, projection.coefficients * w);
  fit_to_window(&result, factor.r * result.combination, factor.r);
  describe_nearest(&result, eigenpair_residual(projection.q_tilde, w, pair->value));
  return result;
}

// All that is asked, from the Schur form. Empty where the eigenvalue iteration does not end.
template <typename Real>
std::optional<QuaternionModes<Real>> modes_from_schur_form(const Projection<Real>& projection,
                                                           const SnapshotFactor<Real>& factor,
                                                           const DmdOptions& options) {
  const Eigen::Index m = factor.r.cols(), rank = projection.q_tilde.rows();
  const auto form = schur(projection.q_tilde);
  if (!form.converged) return std::nullopt;
  const ComplexVector<Real> eigenvalues = form.eigenvalues();
  const auto chosen = select_background<Real>(eigenvalues, options.omega_threshold);
  const auto eigenvector = [&](Eigen::Index k) {
    return form.q * triangular_eigenvector(form.t, k);
  };

  // Step 4: Phi = Y V S^-1 W, kept as coefficients of the snapshots.
  QuaternionModes<Real> result(m, static_cast<Eigen::Index>(chosen.size()));
  for (Eigen::Index p = 0; p < result.eigenvalues.size(); ++p) {
    const Eigen::Index k = chosen[static_cast<size_t>(p)];
    const auto w = eigenvector(k);
    result.eigenvalues(p) = eigenvalues(k);
    set_combination(&result, p, projection.coefficients * w);
    if (p == 0)
      describe_nearest(&result, eigenpair_residual(projection.q_tilde, w, eigenvalues(k)));
  }
  if (options.amplitude == Amplitude::window) {
    fit_to_window(&result, factor.r * result.combination, factor.r);
    return result;
  }
  QuaternionModes<Real> all(m, rank);
  for (Eigen::Index k = 0; k < rank; ++k)
    set_combination(&all, k, projection.coefficients * eigenvector(k));
  const auto b = first_frame_amplitudes<Real>(factor.r * all.combination, factor.r.col(0));
  for (Eigen::Index p = 0; p < result.eigenvalues.size(); ++p)
    result.amplitudes.set(p, 0, b.get(chosen[static_cast<size_t>(p)], 0));
  return result;
}

// b_p = (u^H R11 v)^-1 u^H R11 a with a = argmin |R(:, 2..m) a - R(:, 1)|: the paper's amplitude of
// the mode Y v from its left eigenvector u, where the snapshots x_2 .. x_m are independent.
template <typename Real>
std::optional<Quaternion<Real>> first_frame_amplitude(const Pencil<Real>& pencil,
                                                      const RitzPair<Real>& pair,
                                                      const SnapshotFactor<Real>& factor) {
  using Space = std::vector<Quaternion<Real>>;
  const HessenbergQr<Real> later(factor.r.right_cols(factor.r.cols() - 1));
  if (!(later.smallest_pivot() > factor.tolerance * factor.r.norm())) return std::nullopt;
  const auto u = pencil.left_vector(pair.value);
  if (!u) return std::nullopt;
  const auto share = [&](const Space& x) {
    Quaternion<Real> sum;
    const Space bx = pencil.times_b(x);
    for (size_t k = 0; k < bx.size(); ++k) sum += (*u)[k].conj() * bx[k];
    return sum;
  };
  const Quaternion<Real> on_mode = share(pair.vector);
  // A (nearly) defective eigenvalue: left and right vector are orthogonal.
  if (!(on_mode.norm() > factor.tolerance * factor.r.norm())) return std::nullopt;
  return on_mode.inverse() * share(later.solve(to_column(factor.r.col(0))));
}

// The nearest mode at full rank, from the Hessenberg pencil H v = R11 v lambda: no inverse, no
// singular values. Empty where it takes more than that.
template <typename Real>
std::optional<QuaternionModes<Real>> nearest_mode_of_pencil(const QuaternionMatrix<Real>& h,
                                                            const QuaternionMatrix<Real>& r11,
                                                            const SnapshotFactor<Real>& factor,
                                                            Amplitude amplitude) {
  const Eigen::Index m = factor.r.cols();
  const Pencil<Real> pencil(h, r11);
  const auto pair = pencil.nearest();
  if (!pair) return std::nullopt;
  const auto v = to_matrix(pair->vector);
  const auto bv = to_matrix(pencil.times_b(pair->vector));
  QuaternionModes<Real> result(m, 1);
  result.eigenvalues(0) = pair->value;
  set_combination(&result, 0, v);
  if (amplitude == Amplitude::window) {
    fit_to_window(&result, factor.r.right_cols(m - 1) * v, factor.r);
  } else {
    const auto b = first_frame_amplitude(pencil, *pair, factor);
    if (!b) return std::nullopt;
    result.amplitudes.set(0, 0, *b);
  }
  auto expected = bv;
  expected.scale_col(0, Quaternion<Real>(pair->value));
  const Real size = h.norm() + Quaternion<Real>(pair->value).norm() * r11.norm();
  describe_nearest(&result, Real((h * v - expected).norm() / size));
  return result;
}

template <typename Real>
std::optional<QuaternionModes<Real>> full_rank_modes(const SnapshotFactor<Real>& factor,
                                                     const DmdOptions& options) {
  const Eigen::Index past = factor.r.cols() - 1;
  const auto r11 = factor.r.block(0, 0, past, past), h = factor.r.block(0, 1, past, past);
  const Real condition = condition_estimate(ScalarGrid<Real>(r11));
  if (!(condition * factor.tolerance < Real(1))) return std::nullopt;
  std::optional<QuaternionModes<Real>> result;
  if (!(options.omega_threshold > 0))
    result = nearest_mode_of_pencil(h, r11, factor, options.amplitude);
  if (!result) {
    Projection<Real> projection;
    projection.coefficients = solve_upper(r11, QuaternionMatrix<Real>::identity(past));
    projection.q_tilde = h * projection.coefficients;
    result = modes_from_schur_form(projection, factor, options);
  }
  if (!result || !result->combination.all_finite() || !result->amplitudes.all_finite())
    return std::nullopt;
  result->summary.rank = static_cast<int>(past);
  result->summary.condition = static_cast<double>(condition);
  return result;
}

// Step 1 without pixels: singular values of X and the coefficients V S^-1, and U^H for step 2.
template <typename Real>
struct PastSpectrum {
  Eigen::Matrix<Real, Eigen::Dynamic, 1> sigma;
  QuaternionMatrix<Real> u, v_over_s;
};
template <typename Real>
PastSpectrum<Real> past_spectrum(const SnapshotFactor<Real>& factor, Eigen::Index limit) {
  const auto past = factor.r.left_cols(factor.r.cols() - 1);
  PastSpectrum<Real> result;
  Eigen::Matrix<Real, Eigen::Dynamic, 1> values;
  QuaternionMatrix<Real> u, v;
  if (factor.squared) {
    // X X^H in the basis of R.
    auto eigen = hermitian_eigen(past * past.conjugate_transpose());
    values = eigen.values.cwiseMax(Real(0)).cwiseSqrt();
    u = std::move(eigen.vectors);
  } else {
    auto singular = svd(past);
    values = std::move(singular.values);
    u = std::move(singular.u);
    v = std::move(singular.v);
  }
  Eigen::Index rank = 0;
  while (rank < values.size() && values(rank) > factor.tolerance * values(0)) ++rank;
  if (limit > 0) rank = std::min(rank, limit);
  result.sigma = values.head(rank);
  result.u = u.left_cols(rank);
  const Eigen::Matrix<Real, Eigen::Dynamic, 1> inverse = result.sigma.cwiseInverse();
  result.v_over_s = factor.squared
                        ? past.conjugate_transpose() * result.u.scale_cols(inverse.cwiseAbs2())
                        : v.left_cols(rank).scale_cols(inverse);
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
    if (!(options.omega_threshold > 0) && options.amplitude == Amplitude::window)
      result = nearest_mode(projection, factor);
    if (!result) result = modes_from_schur_form(projection, factor, options);
    if (!result) {
      // Nothing is known to bring this about; rank one needs no iteration.
      none.summary.converged = false;
      continue;
    }
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

extern template QuaternionModes<double> reduced_qdmd(const SnapshotFactor<double>&,
                                                     const DmdOptions&);

}  // namespace qdmd
