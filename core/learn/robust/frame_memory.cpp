// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/frame_memory.h"

#include <algorithm>
#include <utility>

#include "core/passes/bands.h"
#include "core/passes/read_samples.h"

namespace qdmd {

FrameMemory::FrameMemory(int capacity, const ChromaShape& shape, const Grid& grid)
    : capacity_(capacity),
      planes_(shape.is_shared() ? PlaneSlots(capacity, shape)
                                : PlaneSlots(capacity, shape.pixels())),
      cells_(grid, capacity) {
  kept_.reserve(static_cast<size_t>(capacity));
}

uint64_t FrameMemory::bytes(int capacity, const ChromaShape& shape, const Grid& grid) {
  return PlaneSlots::bytes(capacity, shape) + GridFrames::bytes(grid, capacity) +
         static_cast<uint64_t>(capacity) * sizeof(Kept);
}

size_t FrameMemory::least_missed(int64_t now) const {
  size_t least = 0;
  double least_ratio = 0;
  for (size_t i = 1; i < kept_.size(); ++i) {
    const int64_t next = i + 1 < kept_.size() ? kept_[i + 1].number : now;
    const double ratio = static_cast<double>(next - kept_[i - 1].number) /
                         static_cast<double>(now - kept_[i].number);
    if (least > 0 && ratio >= least_ratio) continue;
    least = i;
    least_ratio = ratio;
  }
  return least;
}

int FrameMemory::free_slot() const {
  int slot = 0;
  while (std::any_of(kept_.begin(), kept_.end(), [slot](Kept kept) { return kept.slot == slot; }))
    ++slot;
  return slot;
}

void FrameMemory::unshare() {
  PlaneSlots planes(capacity_, planes_.pixels());
  std::vector<uint8_t> room(room_for_planes(planes_.shape()));
  for (const Kept& kept : kept_) {
    const uint8_t* own[3];
    read_planes(planes_.picture(kept.slot), room.data(), own);
    for (int c = 0; c < kChannels; ++c)
      std::copy_n(own[c], planes_.pixels(), planes.plane(kept.slot, c));
  }
  planes_ = std::move(planes);
}

int FrameMemory::older_than(int64_t number) const {
  const auto newer = std::partition_point(kept_.begin(), kept_.end(),
                                          [number](Kept kept) { return kept.number < number; });
  return static_cast<int>(newer - kept_.begin());
}

void FrameMemory::keep(int64_t number, const SnapshotRange& snapshots, int index,
                       const GridFrames& cells, int64_t horizon, Pool* pool) {
  if (capacity_ == 0) return;
  while (!kept_.empty() && kept_.front().number < number - horizon) kept_.erase(kept_.begin());
  if (size() == capacity_)
    kept_.erase(kept_.begin() + static_cast<ptrdiff_t>(least_missed(number)));
  if (planes_.shape().is_shared() && !snapshots.shape().is_shared()) unshare();
  const int free = free_slot();
  planes_.take_pages(free, pool);
  constexpr size_t kParts = 4;  // of a plane
  pool->run(kChannels * kParts, [&](size_t part) {
    const int c = static_cast<int>(part / kParts);
    const Slice slice = {static_cast<int>(part % kParts), kParts};
    const size_t samples =
        c > 0 && planes_.shape().is_shared() ? planes_.shape().samples() : snapshots.pixels();
    const size_t first = slice.first(samples, 1), size = slice.size(samples, 1);
    std::copy_n(snapshots.plane(index, c) + first, size, planes_.plane(free, c) + first);
    if (slice.index == 0)
      std::copy_n(cells.plane(snapshots.slot(index), c), cells.cells(), cells_.plane(free, c));
  });
  kept_.push_back({number, free});
}

}  // namespace qdmd
