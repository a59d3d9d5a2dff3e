// SPDX-License-Identifier: LGPL-2.1-or-later
// What is known of cells, as files have it: times count back from the newest frame, and the grid
// may be another.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/model/learnt.h"
#include "core/passes/grid.h"

namespace qdmd {

// The part, of `theirs` of a length, in which the middle of part k of `ours` lies.
inline int middle_in(int k, int ours, int theirs) {
  return static_cast<int>((2 * int64_t{k} + 1) * theirs / (2 * int64_t{ours}));
}

// Calls what(cell, its) for all cells of a grid: `its` is the cell of a grid of rows x cols at the
// middle of `cell`.
template <typename What>
void each_with_its(const Grid& grid, int rows, int cols, const What& what) {
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      what(static_cast<size_t>(row * grid.cols + col),
           static_cast<size_t>(middle_in(row, grid.rows, rows) * cols +
                               middle_in(col, grid.cols, cols)));
}

// Frames from `number` to the frame `now`.
inline uint32_t frames_ago(int64_t number, int64_t now) {
  return static_cast<uint32_t>(std::clamp<int64_t>(now - number, 0, LearntPlace::kNever - 1));
}

}  // namespace qdmd
