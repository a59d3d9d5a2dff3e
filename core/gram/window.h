// The window of frames: a ring of planar 8-bit pictures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace qdmd {

constexpr int kChannels = 3;  // R, G, B: the i, j and k parts of a pixel's pure quaternion

// Up to `capacity` snapshots of `pixels` pixels. A snapshot is three planes of 8-bit samples,
// kept in the slot where it was written until it is the oldest of a full window; indices count
// from the oldest snapshot. Planes start at multiples of 64 bytes and are padded with zeros, which
// add nothing to an inner product.
class Window {
 public:
  Window() = default;
  // Throws std::bad_alloc. The pages are touched frame by frame, so a short stream in a long window
  // costs only what it fills.
  Window(int capacity, size_t pixels);

  // The bytes that Window(capacity, pixels) reserves.
  static uint64_t bytes(int capacity, size_t pixels);

  int capacity() const { return capacity_; }
  size_t pixels() const { return pixels_; }
  size_t plane_size() const { return plane_size_; }
  // Number of snapshots held, 0 .. capacity.
  int size() const { return size_; }
  // The slot of snapshot `index`, 0 (oldest) .. size() - 1.
  int slot(int index) const { return (oldest_ + index) % capacity_; }

  const uint8_t* plane(int slot, int channel) const { return data_.get() + offset(slot, channel); }
  uint8_t* plane(int slot, int channel) { return data_.get() + offset(slot, channel); }

  // Makes room for the newest snapshot, dropping the oldest of a full window, and returns its slot.
  // The caller fills the three planes' first pixels() samples.
  int append();
  void clear() { oldest_ = size_ = 0; }

 private:
  struct Free {
    void operator()(uint8_t* data) const;
  };
  size_t offset(int slot, int channel) const {
    return (static_cast<size_t>(slot) * kChannels + static_cast<size_t>(channel)) * plane_size_;
  }

  int capacity_ = 0, oldest_ = 0, size_ = 0;
  size_t pixels_ = 0, plane_size_ = 0;
  std::unique_ptr<uint8_t[], Free> data_;
};

// Consecutive snapshots of a window, the oldest first. Names their slots, so that it stays right
// while other snapshots are appended, until one of its own is dropped.
class SnapshotRange {
 public:
  // All that the window holds.
  SnapshotRange(const Window& window) : SnapshotRange(window, 0, window.size()) {}
  // `count` snapshots from index `first` on.
  SnapshotRange(const Window& window, int first, int count)
      : window_(&window), first_slot_(count > 0 ? window.slot(first) : 0), size_(count) {}

  int size() const { return size_; }
  size_t pixels() const { return window_->pixels(); }
  size_t plane_size() const { return window_->plane_size(); }
  int slot(int index) const { return (first_slot_ + index) % window_->capacity(); }
  const uint8_t* plane(int index, int channel) const {
    return window_->plane(slot(index), channel);
  }

  // Its last `count` snapshots.
  SnapshotRange newest(int count) const {
    SnapshotRange range = *this;
    range.first_slot_ = size_ > 0 ? slot(size_ - count) : 0;
    range.size_ = count;
    return range;
  }
  // The snapshots in the same slots of `window`, which has this one's capacity.
  SnapshotRange in(const Window& window) const {
    SnapshotRange range = *this;
    range.window_ = &window;
    return range;
  }

 private:
  const Window* window_;
  int first_slot_, size_;
};

}  // namespace qdmd
