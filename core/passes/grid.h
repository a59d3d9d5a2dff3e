// SPDX-License-Identifier: LGPL-2.1-or-later
// Pictures on a coarse grid: means over cells, on which regions are compared.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/channels.h"
#include "core/base/large_vector.h"
#include "core/parallel/pool.h"
#include "core/planes/kept_picture.h"

namespace qdmd {

// Square cells of about 1/kCellsAlong of the picture's short side, in very thin pictures of
// 1/kMostCellsAlong of the long one; they cover it without overlap.
constexpr int kCellsAlong = 48, kMostCellsAlong = 640;
struct Grid {
  int width = 0, height = 0;  // pixels
  int rows = 0, cols = 0;     // cells

  Grid() = default;
  Grid(int width, int height, int cells_along = kCellsAlong);

  size_t cells() const { return static_cast<size_t>(rows) * static_cast<size_t>(cols); }
  // The first pixel row of a row of cells, the first pixel column of a column.
  int top(int row) const { return static_cast<int>(int64_t{row} * height / rows); }
  int left(int col) const { return static_cast<int>(int64_t{col} * width / cols); }
};

// Pictures of cells: for each one R, then G, then B of all cells in row order, in levels.
class GridFrames {
 public:
  GridFrames() = default;
  GridFrames(size_t cells, int count)
      : cells_(cells), levels_(cells * kChannels * static_cast<size_t>(count), 0.0f) {}
  GridFrames(const Grid& grid, int count) : GridFrames(grid.cells(), count) {}

  static uint64_t bytes(const Grid& grid, int count) {
    return uint64_t{grid.cells()} * kChannels * sizeof(float) * static_cast<uint64_t>(count);
  }
  uint64_t bytes() const { return levels_.capacity() * sizeof(float); }

  size_t cells() const { return cells_; }
  int size() const {
    return cells_ > 0 ? static_cast<int>(levels_.size() / (cells_ * kChannels)) : 0;
  }
  float* plane(int frame, int channel) { return levels_.data() + offset(frame, channel); }
  const float* plane(int frame, int channel) const {
    return levels_.data() + offset(frame, channel);
  }
  std::array<float*, kChannels> channels(int frame) {
    return {plane(frame, 0), plane(frame, 1), plane(frame, 2)};
  }

 private:
  size_t offset(int frame, int channel) const {
    return (static_cast<size_t>(frame) * kChannels + static_cast<size_t>(channel)) * cells_;
  }
  size_t cells_ = 0;
  LargeVector<float> levels_;
};

// Such pictures, wherever they lie: names their places.
class GridPictures {
 public:
  explicit GridPictures(size_t cells) : cells_(cells) {}
  // All of them.
  GridPictures(const GridFrames& frames) : GridPictures(frames.cells()) {  // NOLINT
    for (int frame = 0; frame < frames.size(); ++frame) add(frames.plane(frame, 0));
  }

  void reserve(int count) { of_.reserve(static_cast<size_t>(count)); }
  // R, then G, then B of all cells.
  void add(const float* levels) { of_.push_back(levels); }
  int size() const { return static_cast<int>(of_.size()); }
  size_t cells() const { return cells_; }
  const float* plane(int frame, int channel) const {
    return of_[static_cast<size_t>(frame)] + static_cast<size_t>(channel) * cells_;
  }

 private:
  size_t cells_;
  std::vector<const float*> of_;
};

// The picture that takes each cell from the frame from[cell] of others.
class GridPicture {
 public:
  GridPicture(const GridPictures& frames, const std::vector<int>& from) : cells_(from.size()) {
    levels_.resize(kChannels * cells_);
    for (size_t cell = 0; cell < cells_; ++cell) take(frames, from[cell], cell);
  }
  void take(const GridPictures& frames, int frame, size_t cell) {
    for (int c = 0; c < kChannels; ++c)
      levels_[static_cast<size_t>(c) * cells_ + cell] = frames.plane(frame, c)[cell];
  }
  const float* plane(int channel) const {
    return levels_.data() + static_cast<size_t>(channel) * cells_;
  }

 private:
  size_t cells_;
  std::vector<float> levels_;
};

// The mean of each cell of a plane of grid.width * grid.height samples.
void cell_means(const Grid& grid, const uint8_t* plane, float* means);

// cell_means() of all channels of a picture into picture `frame` of `cells`. pool may be null.
void find_cells(const Grid& grid, const KeptPicture& picture, GridFrames* cells, int frame,
                Pool* pool);

}  // namespace qdmd
