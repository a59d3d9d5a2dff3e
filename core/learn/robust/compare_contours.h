// SPDX-License-Identifier: LGPL-2.1-or-later
// What most frames of a window show, corrected where its contour says that it stands before
// something else.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/passes/grid.h"

namespace qdmd {

// What the frames of a window say of each cell.
struct ShownLooks {
  const GridPictures& frames;      // in one light; the earlier background last, if there is one
  int count;                       // of the frames
  std::span<const float> density;  // by looks, then by cells: in how many frames each is shown
  std::span<const uint8_t> known;  // cells whose earlier background stays, once they have it
  std::function<bool(size_t cell, int look)> counts;  // false where a look says nothing
};

// Frames propose themselves for the regions where they differ from the background, (*from)[cell] by
// cells: what has the weaker contour there is the background. Something that stood still for most
// of the window ends at a contour that the true background does not have. What is said of a region
// holds for the cells around it that change less: somebody in the ground's colours is a part of the
// region, too.
void compare_contours(const Grid& grid, const ShownLooks& looks, std::vector<int>* from);

}  // namespace qdmd
