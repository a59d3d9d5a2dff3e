#include <cmath>

#include "core/dmd/qdmd.h"
#include "core/quaternion/factorize.h"
#include "core/quaternion/hermitian.h"
#include "core/quaternion/schur.h"

namespace qdmd {
namespace {

// Columns (k x m, k <= m) with the same inner products as the snapshots: whatever is asked of the
// pixels' geometry can be asked of these.
QuaternionMatrixd reduced_snapshots(const QuaternionMatrixd& g) {
  const double tolerance = gram_tolerance(g.rows());
  if (auto r = cholesky(g, tolerance)) return *std::move(r);
  const auto eigen = hermitian_eigen(g);
  const Eigen::Index rank = (eigen.values.array() > tolerance * eigen.values(0)).count();
  return eigen.vectors.left_cols(rank)
      .scale_cols(eigen.values.head(rank).cwiseSqrt())
      .conjugate_transpose();
}

}  // namespace

BackgroundModes qdmd_from_gram(const QuaternionMatrixd& g, const DmdOptions& options) {
  using Index = Eigen::Index;
  BackgroundModes result;
  const Index m = g.rows();
  result.combination = QuaternionMatrixd(m, 0);
  result.amplitudes = QuaternionMatrixd(0, 1);
  if (m < 2) return result;

  // Step 1: S and V of X = [x_1 .. x_{m-1}].
  const auto eigen = hermitian_eigen(g.block(0, 0, m - 1, m - 1));
  Index rank = (eigen.values.array() > gram_tolerance(m - 1) * eigen.values(0)).count();
  if (!(eigen.values(0) > 0)) rank = 0;
  if (options.rank > 0) rank = std::min<Index>(rank, options.rank);
  result.summary.rank = static_cast<int>(rank);
  if (rank == 0) return result;
  const Eigen::VectorXd sigma = eigen.values.head(rank).cwiseSqrt();
  result.summary.condition = sigma(0) / sigma(rank - 1);
  const QuaternionMatrixd v_over_s = eigen.vectors.left_cols(rank).scale_cols(sigma.cwiseInverse());

  // Steps 2 and 3: Q~ and its right spectral decomposition.
  const QuaternionMatrixd q_tilde =
      v_over_s.conjugate_transpose() * (g.block(0, 1, m - 1, m - 1) * v_over_s);
  const auto form = schur(q_tilde);
  if (!form.converged) {
    DmdOptions rank_one = options;
    rank_one.rank = 1;
    result = qdmd_from_gram(g, rank_one);
    result.summary.converged = false;
    return result;
  }
  const Eigen::VectorXcd eigenvalues = form.eigenvalues();
  const auto chosen = select_background(eigenvalues, options.omega_threshold);
  const Index modes = static_cast<Index>(chosen.size());

  // Step 4: Phi = Y V S^-1 W, kept as coefficients of the snapshots; x_1 has none.
  const auto eigenvector = [&](Index k) { return form.q * triangular_eigenvector(form.t, k); };
  const auto combination_of = [&](const QuaternionMatrixd& w) {
    QuaternionMatrixd c(m, w.cols());
    const auto lower = v_over_s * w;
    c.a.bottomRows(m - 1) = lower.a;
    c.b.bottomRows(m - 1) = lower.b;
    return c;
  };
  QuaternionMatrixd w(rank, modes);
  result.eigenvalues.resize(modes);
  for (Index p = 0; p < modes; ++p) {
    const auto vector = eigenvector(chosen[static_cast<size_t>(p)]);
    w.a.col(p) = vector.a;
    w.b.col(p) = vector.b;
    result.eigenvalues(p) = eigenvalues(chosen[static_cast<size_t>(p)]);
  }
  result.combination = combination_of(w);

  // Amplitudes, on columns that stand for the pixels.
  const QuaternionMatrixd r = reduced_snapshots(g);
  result.reference_times = Eigen::VectorXd::Zero(modes);
  if (options.amplitude == Amplitude::window) {
    fit_to_window(&result, r * result.combination, r);
  } else {
    QuaternionMatrixd all(rank, rank);
    for (Index k = 0; k < rank; ++k) {
      const auto vector = eigenvector(k);
      all.a.col(k) = vector.a;
      all.b.col(k) = vector.b;
    }
    const auto b = first_frame_amplitudes(r * combination_of(all), r.col(0));
    result.amplitudes = QuaternionMatrixd(modes, 1);
    for (Index p = 0; p < modes; ++p)
      result.amplitudes.set(p, 0, b.get(chosen[static_cast<size_t>(p)], 0));
  }

  describe_nearest(&result, q_tilde, w.col(0));
  return result;
}

}  // namespace qdmd
