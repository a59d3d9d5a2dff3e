// SPDX-License-Identifier: LGPL-2.1-or-later
// Where the background moves by itself: leaves, water, edges before a camera that shakes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/foreground/decision_steps.h"
#include "core/passes/grid.h"

namespace qdmd {

// Statistics of the cells of a coarse grid. A pixel that differs from the background is explained
// if it looks like the background next to it: leaves and edges were there a moment ago, but a
// person who comes was not. It is restless if it is not as it was in the frame before. Leaves are
// restless; a person who stands is not, even if the background shows the same person a little
// beside. A cell moves if, in the cells around it, enough pixels differ, and enough of these are
// explained and restless. It must always have been so: the share of pixels that differ has hardly
// been below its average, and is not far above it in the newest frame. (People stay, too, but they
// were not there from the beginning.)
class MovingTexture {
 public:
  // Pixels of a cell on one row: 255 where they differ; squared distances from the background, from
  // the nearest of the background around, and from the frame before.
  struct Sample {
    const uint8_t* differing;
    const uint16_t *own, *nearest, *moved;
    int count;
  };

  // Takes all memory.
  MovingTexture(int width, int height, const DecisionConstants& constants = {});
  static uint64_t bytes(int width, int height, const DecisionConstants& constants = {});

  const Grid& grid() const { return grid_; }
  // The cell of a row of cells that has the pixel column.
  int col_of(int x) const { return cols_[static_cast<size_t>(x)]; }
  // Begins afresh.
  void forget();
  // True where the cell moves.
  bool moves(size_t cell) const { return cells_[cell].moves; }
  // Rows that are looked at: a few of each cell say enough.
  bool samples(int y) const { return y % row_step_ == 0; }
  // The samples of a plane in such a row of the frame before.
  const uint8_t* before(int channel, int y) const { return before_.data() + offset(channel, y); }
  // threshold: levels above which pixels differ. From any threads.
  void add(size_t cell, const Sample& sample, double threshold);
  // After the last cell of a frame whose planes are x. last: the next cells are of another frame.
  void end_frame(const uint8_t* const x[3], bool last = true);
  // Frames that ended.
  int64_t frames() const { return frames_; }

  // What the newest of the frames in which the cell moved counts in means.
  float share(size_t cell) const { return 1 / static_cast<float>(std::max(cells_[cell].moved, 1)); }

 private:
  struct Cell {
    int differ = 0, explained = 0, restless = 0;  // pixels of the frame
    // Shares of the pixels: averages, of the newest frames, of the last one, and the least of the
    // newest.
    float differing = 0, explained_share = 0, restless_share = 0, recent = 0, now = 0, least = 0;
    bool moves = false;
    int moved = 0;  // frames in which it did, texture_samples at most
  };

  size_t offset(int channel, int y) const {
    return (static_cast<size_t>(y / row_step_) * 3 + static_cast<size_t>(channel)) *
           static_cast<size_t>(grid_.width);
  }
  float sampled_pixels(int row, int col) const;
  bool moves_now(int row, int col) const;

  DecisionConstants constants_;
  Grid grid_;
  int row_step_;
  std::vector<uint16_t> cols_;
  int64_t frames_ = 0;
  std::vector<Cell> cells_;
  std::vector<uint8_t> before_;
};

}  // namespace qdmd
