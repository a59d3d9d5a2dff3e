// SPDX-License-Identifier: LGPL-2.1-or-later
// Which frames show a region's background: the start of robust Q-DMD.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/large_vector.h"
#include "core/parallel/pool.h"
#include "core/passes/grid.h"

namespace qdmd {

// A list of frames for each cell, in memory that depends on no picture.
class FrameLists {
 public:
  FrameLists() = default;
  // Empty lists, for up to `most` frames each.
  FrameLists(size_t cells, int most)
      : most_(static_cast<size_t>(most)),
        counts_(cells, 0),
        chosen_(cells, 0),
        frames_(cells * most_) {}
  static uint64_t bytes(uint64_t cells, uint64_t most) {
    return cells * (most + 2) * sizeof(uint16_t);
  }

  size_t size() const { return counts_.size(); }
  // Those that are chosen: all, or what choose() left; in time order.
  std::span<const uint16_t> operator[](size_t cell) const {
    return {frames_.data() + cell * most_, chosen_[cell]};
  }
  // How many there are, chosen or not, of the frames t < `end`.
  size_t count_before(size_t cell, int end) const {
    const uint16_t* const list = frames_.data() + cell * most_;
    return static_cast<size_t>(
        std::count_if(list, list + counts_[cell], [end](uint16_t t) { return t < end; }));
  }
  size_t count(size_t cell) const { return counts_[cell]; }
  void add(size_t cell, int frame) {
    frames_[cell * most_ + counts_[cell]++] = static_cast<uint16_t>(frame);
    chosen_[cell] = counts_[cell];
  }
  // Makes it the list of frames t < `most` with shows(t).
  template <typename Shows>
  void take(size_t cell, Shows shows) {
    uint16_t* list = frames_.data() + cell * most_;
    size_t count = 0;
    // Without a branch that nobody foresees.
    for (size_t t = 0; t < most_; ++t) {
      list[count] = static_cast<uint16_t>(t);
      count += shows(t) ? 1 : 0;
    }
    counts_[cell] = chosen_[cell] = static_cast<uint16_t>(count);
  }
  // Chooses those of the list with keeps(t).
  template <typename Keeps>
  void choose(size_t cell, Keeps keeps) {
    uint16_t* const list = frames_.data() + cell * most_;
    chosen_[cell] =
        static_cast<uint16_t>(std::stable_partition(list, list + counts_[cell], keeps) - list);
  }

 private:
  size_t most_ = 0;
  std::vector<uint16_t> counts_, chosen_, frames_;
};

// Frames that show what contours rejected: something else than the background, which most frames
// show. It differs by more than light does (contours.looks_differ).
class Rejected {
 public:
  Rejected() = default;
  // Of `looks` frames, for so many cells.
  Rejected(size_t cells, size_t looks) : looks_(looks), each_((looks + 7) / 8) {
    cells_.reserve(cells);
    bits_.reserve(cells * each_);
  }
  static uint64_t bytes(uint64_t cells, uint64_t looks) {
    return cells * (sizeof(int) + (looks + 7) / 8);
  }

  // In the grid's order.
  const std::vector<int>& cells() const { return cells_; }
  // The at-th of these cells shows in frame `look` what was rejected.
  bool shows(size_t at, size_t look) const {
    return ((bits_[at * each_ + look / 8] >> (look % 8)) & 1) != 0;
  }
  // Adds a cell and its frames, those with shows(look).
  template <typename Shows>
  void add(int cell, Shows shows) {
    cells_.push_back(cell);
    bits_.resize(bits_.size() + each_);
    uint8_t* const bits = bits_.data() + bits_.size() - each_;
    for (size_t t = 0; t < looks_; ++t)
      bits[t / 8] = static_cast<uint8_t>(bits[t / 8] | (shows(t) ? 1 : 0) << (t % 8));
  }

 private:
  size_t looks_ = 0, each_ = 0;
  std::vector<int> cells_;
  std::vector<uint8_t> bits_;
};

// For each cell the frames that show its background, in time order, and the patches' distance from
// it up to which they do.
struct StableFrames {
  FrameLists of_cell;
  std::vector<float> limit;
  Rejected rejected;
  // Too little of what was known before is seen again: the camera moved, or the scene is another.
  bool another_scene = false;

  // Where `looks` frames are compared.
  static uint64_t bytes(const Grid& grid, uint64_t looks) {
    return FrameLists::bytes(grid.cells(), looks) + Rejected::bytes(grid.cells(), looks) +
           grid.cells() * sizeof(float);
  }
};

// What a cell's look in an earlier window says: as much as `weight` frames that show it, where
// patches are alike up to `limit`.
struct Recollection {
  std::vector<float> weight, limit;
  std::vector<float> share;  // of the frames that could have shown it; empty: unknown
  int older_frames = 0;      // of those that are compared with it, the first so many are no news
};

// The looks of a cell that count: those from `from` on, and the earlier windows' unless
// `earlier_counts` is 0. Empty: all do.
struct FirstLooks {
  FirstLooks() = default;
  explicit FirstLooks(size_t cells) : from(cells), earlier_counts(cells, 1) {}

  std::vector<uint16_t> from;
  std::vector<uint8_t> earlier_counts;
  bool absorbed = false;  // some looks are background only because they stood for so long
};

// Memory that solves use again: taken anew, each of its pages would cost a visit to the kernel.
struct StableFramesRoom {
  StableFramesRoom() = default;
  // For up to so many looks; what is not needed is not touched. Throws std::bad_alloc.
  StableFramesRoom(const Grid& grid, uint64_t looks);
  static uint64_t bytes(const Grid& grid, uint64_t looks);

  LargeVector<float> density;
  LargeVector<uint16_t> steps, distance;
};

// frames: `count` pictures in one light, and a further one of the background in earlier windows
// where `earlier` is given; it is frame `count` then. A cell's background is the look of the patch
// around it that most frames share (the mode of the patches' density), corrected where another
// frame's region fits its surroundings better: what stands still for long shows by its contour. If
// something hides most of the picture, looks that have its colours count less. held: cells that
// keep the earlier background, if enough frames have shown it; or none. room: null: memory
// is taken anew.
StableFrames find_stable_frames(const Grid& grid, const GridPictures& frames, int count,
                                const Recollection* earlier, Pool* pool,
                                const FirstLooks& first_looks = {},
                                StableFramesRoom* room = nullptr,
                                std::span<const uint8_t> held = {});
// The memory that it takes beside the room while it looks for them.
uint64_t stable_frames_bytes(const Grid& grid, uint64_t looks, int threads);

}  // namespace qdmd
