// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames that have left the window: some of them are kept, the older, the sparser.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frames/frame_store.h"

namespace qdmd {

// Up to `capacity` frames of a stream with their cells. Each frame has a number, which counts the
// stream's frames. A new frame takes the place of the one that is missed least: its neighbours are
// near in time, compared with how long ago it was. So distances in time grow with age.
class FrameMemory {
 public:
  FrameMemory() = default;
  // Takes all memory.
  FrameMemory(int capacity, const ChromaShape& shape, const Grid& grid);
  static uint64_t bytes(int capacity, const ChromaShape& shape, const Grid& grid);
  // The bytes that it takes more, for a moment, where pixels share no samples any more.
  static uint64_t bytes_to_unshare(int capacity, const ChromaShape& shape) {
    return shape.is_shared() ? PlaneSlots::bytes(capacity, shape.pixels()) : 0;
  }

  void forget() { kept_.clear(); }
  int size() const { return static_cast<int>(kept_.size()); }
  // Frames in time order: 0 is the oldest.
  int64_t number(int index) const { return kept_[static_cast<size_t>(index)].number; }
  // -1: there is none.
  int64_t newest() const { return kept_.empty() ? -1 : kept_.back().number; }
  // How many frames have smaller numbers.
  int older_than(int64_t number) const;
  const uint8_t* plane(int index, int channel) const { return planes_.plane(slot(index), channel); }
  // What planes share.
  const ChromaShape& shape() const { return planes_.shape(); }
  const GridFrames& cells() const { return cells_; }
  int slot(int index) const { return kept_[static_cast<size_t>(index)].slot; }

  // Keeps a copy of frame `number`, which is newer than all others: snapshot `index` of `snapshots`
  // with its cells. Frames older than `horizon` frames are forgotten. If its pixels share no
  // samples any more, those of all frames get their own: throws std::bad_alloc.
  void keep(int64_t number, const SnapshotRange& snapshots, int index, const GridFrames& cells,
            int64_t horizon, Pool* pool);

 private:
  struct Kept {
    int64_t number;
    int slot;
  };
  size_t least_missed(int64_t now) const;
  int free_slot() const;
  void unshare();

  int capacity_ = 0;
  PlaneSlots planes_;
  GridFrames cells_;
  std::vector<Kept> kept_;  // in time order
};

}  // namespace qdmd
