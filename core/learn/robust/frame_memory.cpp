#include "core/learn/robust/frame_memory.h"

#include <algorithm>

namespace qdmd {

FrameMemory::FrameMemory(int capacity, size_t pixels, const Grid& grid)
    : capacity_(capacity), planes_(capacity, pixels), cells_(grid, capacity) {
  kept_.reserve(static_cast<size_t>(capacity));
}

uint64_t FrameMemory::bytes(int capacity, size_t pixels, const Grid& grid) {
  return PlaneSlots::bytes(capacity, pixels) + GridFrames::bytes(grid, capacity) +
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

int FrameMemory::older_than(int64_t number) const {
  const auto newer = std::partition_point(kept_.begin(), kept_.end(),
                                          [number](Kept kept) { return kept.number < number; });
  return static_cast<int>(newer - kept_.begin());
}

void FrameMemory::keep(int64_t number, const SnapshotRange& snapshots, int index,
                       const GridFrames& cells, int64_t horizon) {
  if (capacity_ == 0) return;
  while (!kept_.empty() && kept_.front().number < number - horizon) kept_.erase(kept_.begin());
  if (size() == capacity_)
    kept_.erase(kept_.begin() + static_cast<ptrdiff_t>(least_missed(number)));
  const int free = free_slot();
  for (int c = 0; c < kChannels; ++c) {
    std::copy_n(snapshots.plane(index, c), snapshots.pixels(), planes_.plane(free, c));
    std::copy_n(cells.plane(snapshots.slot(index), c), cells.cells(), cells_.plane(free, c));
  }
  kept_.push_back({number, free});
}

}  // namespace qdmd
