// Which frames show a region's background: the start of robust Q-DMD.
#pragma once

#include <vector>

#include "core/background/robust/grid.h"
#include "core/parallel/pool.h"

namespace qdmd {

// For each cell the frames that show its background, in time order.
struct StableFrames {
  std::vector<std::vector<int>> of_cell;
};

// frames: `count` pictures in one light. A cell's background is the look of the patch around it
// that most frames share (the mode of the patches' density), corrected where another frame's region
// fits its surroundings better: what stands still for long shows by its contour.
StableFrames find_stable_frames(const Grid& grid, const GridFrames& frames, int count, Pool* pool);

}  // namespace qdmd
