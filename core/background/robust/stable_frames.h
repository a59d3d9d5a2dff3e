// Which frames show a region's background: the start of robust Q-DMD.
#pragma once

#include <vector>

#include "core/background/robust/grid.h"
#include "core/parallel/pool.h"

namespace qdmd {

// For each cell the frames that show its background, in time order, and the patches' distance from
// it up to which they do.
struct StableFrames {
  std::vector<std::vector<int>> of_cell;
  std::vector<float> limit;
};

// What a cell's look in an earlier window says: as much as `weight` frames that show it, where
// patches are alike up to `limit`.
struct Recollection {
  std::vector<float> weight, limit;
};

// frames: `count` pictures in one light, and a further one of the background in earlier windows
// where `earlier` is given; it is frame `count` then. A cell's background is the look of the patch
// around it that most frames share (the mode of the patches' density), corrected where another
// frame's region fits its surroundings better: what stands still for long shows by its contour.
StableFrames find_stable_frames(const Grid& grid, const GridFrames& frames, int count,
                                const Recollection* earlier, Pool* pool);

}  // namespace qdmd
