// Where the background moves by itself: leaves, water, edges before a camera that shakes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/passes/grid.h"

namespace qdmd {

// Statistics of the cells of a coarse grid. A pixel that differs from the background is explained
// where it looks like the background next to it: leaves and edges were there a moment ago, a person
// who comes was not. A cell moves where, in the cells around it, enough pixels differ, enough of
// these are explained, and where this never stopped: the share of pixels that differ has hardly
// been below its average. (People stay, too, but they were not there from the beginning.)
class MovingTexture {
 public:
  // Takes all memory. For pictures of width x height pixels.
  MovingTexture(int width, int height);
  static uint64_t bytes(int width, int height);

  const Grid& grid() const { return grid_; }
  // Begins afresh.
  void forget();
  // True where the cell moves.
  bool moves(size_t cell) const { return cells_[cell].moves; }
  // Rows that are looked at: a few of each cell say enough.
  bool samples(int y) const { return y % row_step_ == 0; }
  // Of the frame's sampled rows: so many more of the cell's pixels differ, and so many of them are
  // explained. Threads have cells of their own.
  void add(size_t cell, int differ, int explained) {
    cells_[cell].differ += differ;
    cells_[cell].explained += explained;
  }
  // After the last cell of a frame.
  void end_frame();

  // Of the frames in which the cell moved, what the newest one counts in means.
  float share(size_t cell) const { return 1 / static_cast<float>(std::max(cells_[cell].moved, 1)); }

 private:
  static constexpr int kMostMoved = 50;

  struct Cell {
    int differ = 0, explained = 0;  // pixels of the frame
    // Shares of the pixels: of about the last 100 frames, of the last 10, and the least of these.
    float differing = 0, explained_share = 0, recent = 0, least = 0;
    bool moves = false;
    int moved = 0;  // frames in which it did, kMostMoved at most
  };

  float sampled_pixels(int row, int col) const;

  Grid grid_;
  int row_step_;
  int64_t frames_ = 0;
  std::vector<Cell> cells_;
};

}  // namespace qdmd
