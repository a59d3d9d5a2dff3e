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

// Q-DMD of the window by the solver that `options` names; arguments as below. Options::method is
// not looked at.
BackgroundModes quaternion_modes(const SnapshotRange& snapshots, const IntegerMatrix& gram,
                                 const DmdOptions& options);

// `gram` is the exact Gram matrix of `window` in time order (3m x 3m). The pixels are read by
// Solver::qr and Solver::adjoint only. m >= 1; a single snapshot is its own background.
Decomposition decompose(const SnapshotRange& snapshots, const IntegerMatrix& gram,
                        const DmdOptions& options);

}  // namespace qdmd
