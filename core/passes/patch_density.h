// How alike the patches around a cell are in different frames.
#pragma once

#include "core/parallel/pool.h"
#include "core/passes/grid.h"

namespace qdmd {

constexpr int kPatchRadius = 2;  // cells: patches of 5 x 5
constexpr float kSimilar =
    5;  // levels a channel: the distance at which patches are no longer alike
constexpr float kMostDistance = 40;  // levels a channel: a cell counts at most this

// density[t * cells + cell] = sum over frames s of max(0, 1 - d(s, t) / kSimilar), where d is the
// mean absolute difference of the patches around the cell. Costs count^2 / 2 times some 30
// operations a cell.
void patch_density(const Grid& grid, const GridFrames& frames, int count, Pool* pool,
                   float* density);

// distance[t * cells + cell]: d of the patch around the cell in frame t and in frame
// reference[cell].
void patch_distance(const Grid& grid, const GridFrames& frames, int count, const int* reference,
                    Pool* pool, float* distance);

}  // namespace qdmd
