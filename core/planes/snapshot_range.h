// SPDX-License-Identifier: LGPL-2.1-or-later
// Some of a window's snapshots, in time order.
#pragma once

#include "core/planes/window.h"

namespace qdmd {

// Consecutive snapshots of a window, the oldest first, or every stride-th of them. Names their
// slots, so that it stays right while other snapshots are appended, until one of its own is
// dropped.
class SnapshotRange {
 public:
  // All that the window holds.
  SnapshotRange(const Window& window) : SnapshotRange(window, 0, window.size()) {}  // NOLINT
  // `count` snapshots from index `first` on.
  SnapshotRange(const Window& window, int first, int count)
      : planes_(&window), first_slot_(count > 0 ? window.slot(first) : 0), size_(count) {}

  int size() const { return size_; }
  int depth() const { return planes_->depth(); }  // bits of a sample
  size_t pixels() const { return planes_->pixels(); }
  size_t plane_size() const { return planes_->plane_size(); }
  int slot(int index) const { return (first_slot_ + index * stride_) % planes_->capacity(); }
  const ChromaShape& shape() const { return planes_->shape(); }
  // Planes as they are kept: channels 1 and 2 have the shared samples, if there are any. The
  // highest eight bits, and all of them.
  const uint8_t* plane(int index, int channel) const {
    return planes_->plane(slot(index), channel);
  }
  Samples samples(int index, int channel) const { return planes_->samples(slot(index), channel); }
  KeptPicture picture(int index) const { return planes_->picture(slot(index)); }
  // A whole sample, in units of its lowest bit. Where each pixel has its own.
  double sample(int index, int channel, size_t pixel) const {
    return sample_at(samples(index, channel), pixel, depth());
  }

  bool on_disk() const { return planes_->on_disk(); }
  // Where they are: snapshot `index`, which may be one behind the last, is read soon; `count`
  // pixels of it, 1 at least, from `first` on are.
  void will_need(int index) const {
    if (index < size_) planes_->will_need(slot(index));
  }
  void will_need(int index, size_t first, size_t count) const {
    planes_->will_need(slot(index), first, count);
  }

  // The last `count` snapshots of it.
  SnapshotRange newest(int count) const {
    SnapshotRange range = *this;
    range.first_slot_ = size_ > 0 ? slot(size_ - count) : 0;
    range.size_ = count;
    return range;
  }
  // Every stride-th of them, the first included.
  SnapshotRange every(int stride) const {
    SnapshotRange range = *this;
    range.stride_ *= stride;
    range.size_ = (size_ + stride - 1) / stride;
    return range;
  }
  // What `planes`, of the same capacity, have in the same slots.
  SnapshotRange in(const PlaneSlots& planes) const {
    SnapshotRange range = *this;
    range.planes_ = &planes;
    return range;
  }

 private:
  const PlaneSlots* planes_;
  int first_slot_, size_, stride_ = 1;
};

}  // namespace qdmd
