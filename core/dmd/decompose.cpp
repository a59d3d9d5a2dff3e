// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/decompose.h"

#include <algorithm>
#include <utility>

#include "core/dmd/channel_dmd.h"
#include "core/dmd/qdmd.h"

namespace qdmd {
namespace {

Decomposition single_snapshot() {
  Decomposition result;
  result.background = TemporalModel(1);
  QuaternionMatrixd one(1, 1);
  one.set(0, 0, Quaterniond(1.0));
  result.background.add_mode(one, 1.0, 0, Quaterniond(1.0));
  result.summary.rank = 1;
  result.summary.background_modes = 1;
  result.summary.lambda = 1;
  return result;
}

}  // namespace

Decomposition decompose(const SnapshotRange& snapshots, IntegerMatrix gram,
                        const DmdOptions& options, double pixels) {
  const auto m = static_cast<int>(gram.rows() / kChannels);
  if (m == 1) return single_snapshot();
  const BackgroundModes modes = quaternion_modes(snapshots, std::move(gram), options, pixels);
  Decomposition result;
  result.background = TemporalModel(m);
  for (Eigen::Index p = 0; p < modes.eigenvalues.size(); ++p)
    result.background.add_mode(modes.combination.col(p), modes.eigenvalues(p),
                               modes.reference_times(p), modes.amplitudes.get(p, 0));
  result.summary = modes.summary;
  return result;
}

Decomposition decompose_channels(const IntegerMatrix& gram, const DmdOptions& options) {
  if (gram.rows() == kChannels) return single_snapshot();
  Decomposition result;
  result.background = TemporalModel(static_cast<int>(gram.rows() / kChannels));
  for (int c = 0; c < kChannels; ++c) {
    const ChannelModes modes = channel_dmd(channel_gram(gram, c), options);
    for (Eigen::Index p = 0; p < modes.eigenvalues.size(); ++p)
      result.background.add_channel_mode(c, modes.combination.col(p), modes.eigenvalues(p),
                                         modes.reference_times(p), modes.amplitudes(p));
    const bool converged = result.summary.converged && modes.summary.converged;
    if (c == 0 || modes.summary.omega > result.summary.omega) result.summary = modes.summary;
    result.summary.converged = converged;
  }
  return result;
}

namespace {

// The number of modes of one window, or of one channel of it, at most.
int most_modes(const DmdOptions& options, int snapshots) {
  if (!(options.omega_threshold > 0)) return 1;
  int modes = std::max(1, snapshots - 1);
  if (options.rank > 0) modes = std::min(modes, options.rank);
  if (options.max_modes > 0) modes = std::min(modes, options.max_modes);
  return modes;
}

}  // namespace

int most_pictures(const DmdOptions& options, int snapshots) {
  return 4 * most_modes(options, snapshots);
}

int most_channel_pictures(const DmdOptions& options, int snapshots) {
  // Real and imaginary part, and the conjugate's; there are no more modes than singular values.
  const int modes = std::min(2 * most_modes(options, snapshots), std::max(1, snapshots - 1));
  return kChannels * 2 * modes;
}

namespace {

// How many m x m matrices are alive at once where most are, the snapshot factor R included.
double most_matrices(const DmdOptions& options) {
  // Beside a solve: the Gram matrix, and what is moved to see how sure it is.
  constexpr double kSure = 2;
  if (options.spectrum) return 14 + kSure;
  // The amplitudes of all modes at once, by Eigen on the complex adjoint.
  if (options.omega_threshold > 0 && options.amplitude == Amplitude::first_frame) return 14 + kSure;
  // Singular values: from a Hermitian matrix's eigenvectors, or without squaring.
  if (options.rank > 0) return (options.solver == Solver::gram ? 8 : 10.7) + kSure;
  // The right-hand side of first_frame beside the pencil.
  if (options.amplitude == Amplitude::first_frame) return 8 + kSure;
  // R, the pencil H and R11 twice, H - R11 twice.
  // Derivatives tell how sure the paper's estimate is, without matrices that are moved.
  const bool told = options.estimator == Estimator::exact;
  return told && options.solver != Solver::gram_extended ? 8 : 7 + kSure;
}

}  // namespace

uint64_t decomposition_bytes(const DmdOptions& options, double pixels, int snapshots) {
  const double m = snapshots, matrix = sizeof(Quaterniond) * m * m;
  // The space of Arnoldi's method.
  constexpr double kSpace = 8 << 10;
  const double reduced = most_matrices(options) * matrix + kSpace;
  switch (options.solver) {
    case Solver::automatic:
    case Solver::gram:
    case Solver::gram_extended:
      break;
    case Solver::qr: {
      // A block of rows below R, as many reflectors less their triangle, R of the block, and the
      // Gram matrix, by which the bound goes.
      const double rows = std::max(512.0, 2 * m) + m;
      return static_cast<uint64_t>(
          std::max(2 * sizeof(Quaterniond) * rows * m + 2.15 * matrix, reduced));
    }
    case Solver::adjoint:
      return static_cast<uint64_t>(adjoint_bytes(pixels, m));
  }
  return static_cast<uint64_t>(reduced);
}

uint64_t channel_decomposition_bytes(const DmdOptions& options, int snapshots) {
  const double m = snapshots;
  // Eigen has temporary matrices below this on the stack.
  const bool heap = sizeof(std::complex<double>) * m * m > EIGEN_STACK_ALLOCATION_LIMIT;
  // The Gram matrix has nine such parts, a channel's eigenvectors four; what comes then goes with
  // the rank.
  double matrices = options.amplitude == Amplitude::first_frame ? 33.5 : heap ? 28 : 25.2;
  if (options.rank > 0) matrices = std::min(matrices, 13.5 + (matrices - 13.5) * options.rank / m);
  const double modes = options.omega_threshold > 0 ? 2 * most_modes(options, snapshots) : 2;
  return static_cast<uint64_t>(sizeof(double) * matrices * m * m +
                               6 * sizeof(std::complex<double>) * modes * m);
}

}  // namespace qdmd
