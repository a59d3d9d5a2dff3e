// SPDX-License-Identifier: LGPL-2.1-or-later
// The cells around a cell.
#pragma once

#include <algorithm>

#include "core/passes/grid.h"

namespace qdmd {

// Calls what(near) for the cell and all that are at most `reach` rows and columns from it.
template <typename What>
void each_near(const Grid& grid, int cell, int reach, const What& what) {
  const int y = cell / grid.cols, x = cell % grid.cols;
  for (int yy = std::max(0, y - reach); yy <= std::min(grid.rows - 1, y + reach); ++yy)
    for (int xx = std::max(0, x - reach); xx <= std::min(grid.cols - 1, x + reach); ++xx)
      what(yy * grid.cols + xx);
}

}  // namespace qdmd
