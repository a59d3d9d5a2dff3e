// SPDX-License-Identifier: LGPL-2.1-or-later
// The window of frames: a ring of pictures.
#pragma once

#include "core/planes/plane_slots.h"

namespace qdmd {

// Up to `capacity` snapshots, a ring of slots. A snapshot is kept in the slot where it was written
// until it is the oldest of a full window; indices count from the oldest snapshot.
class Window : public PlaneSlots {
 public:
  using PlaneSlots::PlaneSlots;

  // Number of snapshots held, 0 .. capacity.
  int size() const { return size_; }
  // The slot of snapshot `index`, 0 (oldest) .. size() - 1.
  int slot(int index) const { return (oldest_ + index) % capacity(); }
  int newest_slot() const { return slot(size_ - 1); }

  // Makes room for the newest snapshot, dropping the oldest of a full window, and returns its slot.
  // The caller fills the planes' first samples. pool: takes new memory; may be null.
  int append(Pool* pool = nullptr) {
    if (size_ == capacity()) {
      oldest_ = (oldest_ + 1) % capacity();
      --size_;
    }
    const int newest = slot(size_++);
    take_pages(newest, pool);
    pad(newest);
    return newest;
  }
  // A window of the same snapshots in the same slots, where each pixel has its own samples: the
  // caller fills them. Throws std::bad_alloc.
  Window unshared() const {
    Window window(capacity(), pixels(), depth());
    window.oldest_ = oldest_;
    window.size_ = size_;
    return window;
  }
  void clear() { oldest_ = size_ = 0; }

 private:
  int oldest_ = 0, size_ = 0;
};

}  // namespace qdmd
