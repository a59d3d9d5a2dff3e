// SPDX-License-Identifier: LGPL-2.1-or-later
// Q-DMD by the solver that is asked for, by a more careful one where that cannot, with bounds.
#include <cmath>
#include <optional>
#include <span>

#include "core/dmd/decompose.h"
#include "core/dmd/error_bound.h"
#include "core/dmd/estimator.h"
#include "core/dmd/qdmd.h"

namespace qdmd {
namespace {

using Index = Eigen::Index;

QuaternionMatrixd pixels_of(const SnapshotRange& snapshots) {
  const auto n = static_cast<Index>(snapshots.pixels());
  QuaternionMatrixd x(n, snapshots.size());
  for (int t = 0; t < snapshots.size(); ++t)
    for (Index p = 0; p < n; ++p) {
      const auto pixel = static_cast<size_t>(p);
      x.set(p, t,
            Quaterniond(0.0, snapshots.sample(t, 0, pixel), snapshots.sample(t, 1, pixel),
                        snapshots.sample(t, 2, pixel)));
    }
  return x;
}

// A result that may leave a solve.
bool usable(const BackgroundModes& modes) {
  const DmdSummary& summary = modes.summary;
  return summary.converged && modes.eigenvalues.allFinite() && modes.combination.all_finite() &&
         modes.amplitudes.all_finite() && modes.reference_times.allFinite() &&
         std::isfinite(std::abs(summary.lambda)) && !std::isnan(summary.omega) &&
         std::isfinite(summary.residual) && std::isfinite(summary.condition);
}

// The mean of the frames: what is left where no decomposition ends. It needs none.
BackgroundModes mean_of_frames(Index snapshots) {
  BackgroundModes modes(snapshots, 1);
  modes.eigenvalues(0) = 1;
  modes.amplitudes.set(0, 0, Quaterniond(1.0));
  modes.combination.a.setConstant(1 / static_cast<double>(snapshots));
  modes.summary.rank = 1;
  modes.summary.background_modes = 1;
  modes.summary.lambda = 1;
  modes.summary.converged = false;
  modes.summary.solver = Solver::gram_extended;
  return modes;
}

// All modes of `factor`, by `options`.
std::vector<SpectrumMode> spectrum_of(const SnapshotFactor<double>& factor, DmdOptions options,
                                      double pixels, int background_modes) {
  options.omega_threshold = std::numeric_limits<double>::infinity();
  options.max_modes = 0;
  if (options.estimator == Estimator::optimized) options.estimator = Estimator::exact;
  const auto modes = solve_factor(factor, options);
  std::vector<SpectrumMode> spectrum;
  for (Index p = 0; p < modes.eigenvalues.size(); ++p) {
    auto share = modes.combination.col(p);
    share.scale_col(0, modes.amplitudes.get(p, 0));
    double growth = 1;
    for (double t : {0.0, static_cast<double>(factor.r.cols() - 1)})
      growth = std::max(
          growth, std::abs(power<double>(modes.eigenvalues(p), t - modes.reference_times(p))));
    spectrum.push_back({modes.eigenvalues(p),
                        growth * (factor.r * share).norm() / std::sqrt(3 * std::max(pixels, 1.0)),
                        p < background_modes});
  }
  return spectrum;
}

// One window, which solvers try one after another.
class Ladder {
 public:
  // distinct: distinct_snapshots() of all but the last one.
  Ladder(const SnapshotRange& snapshots, const QuaternionMatrixd& gram, Index distinct,
         const DmdOptions& options, double pixels)
      : snapshots_(snapshots),
        gram_(gram),
        distinct_(distinct),
        options_(options),
        pixels_(pixels) {}

  BackgroundModes solve() {
    const DmdOptions asked = options_;
    auto modes = climb();
    if (asked.spectrum) {
      const bool fast = modes.summary.solver == Solver::gram;
      modes.summary.spectrum = std::make_shared<const std::vector<SpectrumMode>>(
          spectrum_of(fast ? factorize_gram(gram_) : factorize_gram_extended(gram_), asked, pixels_,
                      modes.summary.background_modes));
    }
    return modes;
  }

 private:
  BackgroundModes climb() {
    // The estimators work on inner products.
    if (options_.estimator != Estimator::exact &&
        (options_.solver == Solver::qr || options_.solver == Solver::adjoint))
      options_.solver = Solver::gram_extended;
    switch (options_.solver) {
      case Solver::automatic: {
        auto fast = from_gram(false);
        if (fast && fast->summary.rounding_bound < kSureBound) return *std::move(fast);
        auto careful = extended();
        // Where both are at a loss, the problem is.
        if (careful) return *std::move(careful);
        return fast ? *std::move(fast) : last_resort();
      }
      case Solver::gram:
        if (auto modes = from_gram(true)) return *std::move(modes);
        break;
      case Solver::gram_extended:
        break;
      case Solver::adjoint:
        if (auto modes = from_pixels(Solver::adjoint)) return *std::move(modes);
        [[fallthrough]];
      case Solver::qr:
        if (auto modes = from_pixels(Solver::qr)) return *std::move(modes);
        break;
    }
    if (auto modes = extended()) return *std::move(modes);
    return last_resort();
  }

  // Rank one for what was asked, and then no rank at all.
  BackgroundModes last_resort() {
    if (options_.rank != 1) {
      options_.rank = 1;
      if (auto modes = extended()) {
        modes->summary.converged = false;
        modes->summary.rounding_bound = modes->summary.sensitivity =
            std::numeric_limits<double>::infinity();
        return *std::move(modes);
      }
    }
    return mean_of_frames(gram_.cols());
  }

  void set_bounds(const SnapshotFactor<double>& factor, BackgroundModes* modes) const {
    const SolvedWindow solved{gram_, pixels_, options_, factor, *modes};
    modes->summary.rounding_bound = rounding_bound(solved);
    modes->summary.sensitivity = sensitivity(solved);
  }

  // By Solver::gram. It cannot tell small singular values from zero, but for those of frames that
  // came twice: what else it left out is found by a comparison with extended(), if `compare`, else
  // anything may have been.
  std::optional<BackgroundModes> from_gram(bool compare) {
    const auto factor = factorize_gram(gram_);
    auto modes = solve_factor(factor, options_);
    modes.summary.solver = Solver::gram;
    if (!usable(modes)) return std::nullopt;
    // Other estimators work on more than X: pairs of frames may differ where frames do not.
    const Index columns =
        options_.estimator == Estimator::exact ? distinct_ : std::max<Index>(1, gram_.cols() - 1);
    const Index most = std::min(columns, static_cast<Index>(pixels_));
    const bool low_rank =
        options_.estimator == Estimator::forward_backward || options_.estimator == Estimator::total;
    const Index wanted =
        options_.rank > 0 || low_rank ? std::min<Index>(std::max(1, options_.rank), most) : most;
    // More than there can be are rounding.
    const bool whole = modes.summary.rank >= wanted && modes.summary.rank <= most;
    if (!whole && compare) return compared(std::move(modes));
    if (whole) set_bounds(factor, &modes);
    return modes;
  }

  std::optional<BackgroundModes> extended() {
    const auto factor = factorize_gram_extended(gram_);
    auto modes = solve_factor(factor, options_);
    modes.summary.solver = Solver::gram_extended;
    if (!usable(modes)) return std::nullopt;
    set_bounds(factor, &modes);
    return modes;
  }

  std::optional<BackgroundModes> from_pixels(Solver solver) {
    auto modes = solver == Solver::qr ? qdmd_from_qr(snapshots_, options_)
                                      : qdmd_from_adjoint(pixels_of(snapshots_), options_);
    modes.summary.solver = solver;
    if (!usable(modes)) return std::nullopt;
    return compared(std::move(modes));
  }

  // Held against gram_extended, whose own bound is known: a bound of any procedure, whatever it
  // gets wrong.
  BackgroundModes compared(BackgroundModes modes) {
    if (const auto careful = extended()) {
      modes.summary.rounding_bound =
          careful->summary.rounding_bound +
          background_distance(pivoted_factor(), pixels_, modes, *careful).largest;
      modes.summary.sensitivity = careful->summary.sensitivity;
    }
    return modes;
  }

  // Columns with the inner products of the snapshots, of any rank.
  QuaternionMatrixd pivoted_factor() const { return factorize_gram(gram_).r; }

  const SnapshotRange& snapshots_;
  const QuaternionMatrixd& gram_;
  Index distinct_;
  DmdOptions options_;
  double pixels_;
};

}  // namespace

BackgroundModes quaternion_modes(const SnapshotRange& snapshots, IntegerMatrix gram,
                                 const DmdOptions& options, double pixels) {
  const QuaternionMatrixd g = quaternion_gram(gram);
  const int distinct = distinct_snapshots(gram, std::max(1, snapshots.size() - 1));
  gram.resize(0, 0);
  if (pixels == 0) pixels = static_cast<double>(snapshots.pixels());
  return Ladder(snapshots, g, distinct, options, pixels).solve();
}

}  // namespace qdmd
