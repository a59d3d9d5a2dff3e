// SPDX-License-Identifier: LGPL-2.1-or-later
// One call from a window and its Gram matrix to L(t).
#pragma once

#include "core/dmd/modes.h"
#include "core/dmd/temporal_model.h"
#include "core/gram/gram.h"

namespace qdmd {

struct Decomposition {
  TemporalModel background;
  DmdSummary summary;
};

// Q-DMD of the window by the solver that `options` names; arguments as below.
BackgroundModes quaternion_modes(const SnapshotRange& snapshots, IntegerMatrix gram,
                                 const DmdOptions& options, double pixels = 0);

// Q-DMD (the paper's Algorithm 2). `gram` is the exact Gram matrix of `snapshots` in time order
// (3m x 3m). The pixels are read by Solver::qr and Solver::adjoint only. m >= 1; a single snapshot
// is its own background. pixels: those that `gram` is of, where `snapshots` have fewer (solvers
// that read pixels are out of place then); 0: theirs.
Decomposition decompose(const SnapshotRange& snapshots, IntegerMatrix gram,
                        const DmdOptions& options, double pixels = 0);

// Exact DMD of each channel by itself (the paper's Algorithm 1); options.solver is not looked at.
Decomposition decompose_channels(const IntegerMatrix& gram, const DmdOptions& options);

// The pictures that TemporalModel has at most for a window of m snapshots, m >= 1, of the two.
int most_pictures(const DmdOptions& options, int snapshots);
int most_channel_pictures(const DmdOptions& options, int snapshots);

// The most bytes that the two take while they run, `gram` included, for n = `pixels` and m =
// `snapshots` that are linearly independent, as a camera's noise makes them. Fewer of these take
// less. The channels' modes and Solver::adjoint: about.
uint64_t decomposition_bytes(const DmdOptions& options, double pixels, int snapshots);
uint64_t channel_decomposition_bytes(const DmdOptions& options, int snapshots);

}  // namespace qdmd
