// The window of frames: a ring of planar 8-bit pictures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/base/channels.h"
#include "core/base/large_vector.h"
#include "core/parallel/pool.h"

namespace qdmd {

// Pictures in which no, two neighbouring or 2 x 2 pixels share each sample of channels 1 and 2;
// fewer do at the right and lower edges of odd sizes.
struct ChromaShape {
  int width = 0, height = 0;  // pixels
  int columns = 1, rows = 1;  // of pixels that share a sample; rows is 1 where columns is

  bool is_shared() const { return columns > 1; }
  int chroma_width() const { return (width + columns - 1) / columns; }
  int chroma_height() const { return (height + rows - 1) / rows; }
  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  // Of channel 1 or 2.
  size_t samples() const {
    return static_cast<size_t>(chroma_width()) * static_cast<size_t>(chroma_height());
  }
};

// The planes of a picture: of channels 1 and 2 the shared samples, where the shape says so.
struct KeptPicture {
  KeptPicture(const uint8_t* const planes[kChannels], const ChromaShape& shared = {})  // NOLINT
      : plane{planes[0], planes[1], planes[2]}, shape(shared) {}

  const uint8_t* plane[kChannels];
  ChromaShape shape;  // nothing where each pixel has its own samples
};

// `capacity` slots of three planes of 8-bit samples each. Planes start at multiples of 64 bytes and
// are padded with zeros, which add nothing to an inner product.
class PlaneSlots {
 public:
  PlaneSlots() = default;
  // Throws std::bad_alloc. The pages are touched slot by slot, so a short stream in a long window
  // costs only what it fills.
  PlaneSlots(int capacity, size_t pixels) : PlaneSlots(capacity, pixels, pixels) {}
  // Channels 1 and 2 have their shared samples only.
  PlaneSlots(int capacity, const ChromaShape& shape)
      : PlaneSlots(capacity, shape.pixels(), shape.samples()) {
    shape_ = shape;
  }

  // The bytes that PlaneSlots(capacity, pixels) reserves, and that the other does.
  static uint64_t bytes(int capacity, size_t pixels) { return bytes(capacity, pixels, pixels); }
  static uint64_t bytes(int capacity, const ChromaShape& shape) {
    return bytes(capacity, shape.pixels(), shape.samples());
  }
  uint64_t bytes() const { return reserved_; }

  int capacity() const { return capacity_; }
  size_t pixels() const { return pixels_; }
  size_t plane_size() const { return plane_size_; }
  // Where no samples are shared, it may be nothing.
  const ChromaShape& shape() const { return shape_; }

  const uint8_t* plane(int slot, int channel) const { return data_.get() + offset(slot, channel); }
  uint8_t* plane(int slot, int channel) { return data_.get() + offset(slot, channel); }
  KeptPicture picture(int slot) const {
    const uint8_t* const planes[] = {plane(slot, 0), plane(slot, 1), plane(slot, 2)};
    return {planes, shape_};
  }
  // Takes the memory of slots up to this one on all threads of the pool, and no more than four
  // large pages beyond it. Null, or never called: pages are taken as they are written.
  void take_pages(int slot, Pool* pool);
  // Zeros behind the samples of a slot's planes, whose first ones, as many as a plane has, the
  // caller fills.
  void pad(int slot);

  // From now on planes have `pixels` samples, at most as many as memory was taken for. What they
  // hold is lost.
  void resize(size_t pixels);

 private:
  PlaneSlots(int capacity, size_t pixels, size_t chroma_samples);
  static uint64_t bytes(int capacity, size_t pixels, size_t chroma_samples);
  size_t offset(int slot, int channel) const {
    const size_t before = channel == 0 ? 0 : plane_size_ + (channel == 2 ? chroma_size_ : 0);
    return static_cast<size_t>(slot) * (plane_size_ + 2 * chroma_size_) + before;
  }

  int capacity_ = 0;
  size_t pixels_ = 0, plane_size_ = 0, chroma_samples_ = 0, chroma_size_ = 0;
  ChromaShape shape_;
  uint64_t reserved_ = 0, taken_ = 0;
  std::unique_ptr<uint8_t[], GiveBackLarge> data_;
};

// Up to `capacity` snapshots of `pixels` pixels, a ring of slots. A snapshot is kept in the slot
// where it was written until it is the oldest of a full window; indices count from the oldest
// snapshot.
class Window : public PlaneSlots {
 public:
  using PlaneSlots::PlaneSlots;

  // Number of snapshots held, 0 .. capacity.
  int size() const { return size_; }
  // The slot of snapshot `index`, 0 (oldest) .. size() - 1.
  int slot(int index) const { return (oldest_ + index) % capacity(); }
  int newest_slot() const { return slot(size_ - 1); }

  // Makes room for the newest snapshot, dropping the oldest of a full window, and returns its slot.
  // The caller fills the three planes' first pixels() samples. pool: takes new memory; may be null.
  int append(Pool* pool = nullptr);
  // The same snapshots in the same slots, where each pixel has its own samples: the caller fills
  // them. Throws std::bad_alloc.
  Window unshared() const;
  void clear() { oldest_ = size_ = 0; }

 private:
  int oldest_ = 0, size_ = 0;
};

// Consecutive snapshots of a window, the oldest first. Names their slots, so that it stays right
// while other snapshots are appended, until one of its own is dropped.
class SnapshotRange {
 public:
  // All that the window holds.
  SnapshotRange(const Window& window) : SnapshotRange(window, 0, window.size()) {}
  // `count` snapshots from index `first` on.
  SnapshotRange(const Window& window, int first, int count)
      : planes_(&window), first_slot_(count > 0 ? window.slot(first) : 0), size_(count) {}

  int size() const { return size_; }
  size_t pixels() const { return planes_->pixels(); }
  size_t plane_size() const { return planes_->plane_size(); }
  int slot(int index) const { return (first_slot_ + index * stride_) % planes_->capacity(); }
  const ChromaShape& shape() const { return planes_->shape(); }
  // As it is kept: of channels 1 and 2 the shared samples, if there are any.
  const uint8_t* plane(int index, int channel) const {
    return planes_->plane(slot(index), channel);
  }

  KeptPicture picture(int index) const { return planes_->picture(slot(index)); }

  // Its last `count` snapshots.
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
  // What `planes`, of the same capacity, have in the same slots. Without low digits.
  SnapshotRange in(const PlaneSlots& planes) const {
    SnapshotRange range = *this;
    range.planes_ = &planes;
    range.low_ = nullptr;
    return range;
  }

  // Samples of more than 8 bits: those of plane() are their highest 8, and the `bits` bits below
  // them are in the same slots of `low`, a byte each.
  SnapshotRange with_low(const PlaneSlots& low, int bits) const {
    SnapshotRange range = *this;
    range.low_ = bits > 0 ? &low : nullptr;
    range.low_bits_ = bits;
    return range;
  }
  // 0: samples have 8 bits.
  int low_bits() const { return low_ ? low_bits_ : 0; }
  // Where low_bits() is not 0. Pixels share low digits where they share samples.
  const uint8_t* low_plane(int index, int channel) const {
    return low_->plane(slot(index), channel);
  }
  KeptPicture low_picture(int index) const { return low_->picture(slot(index)); }
  // In units of its lowest bit. Where each pixel has its own samples.
  double sample(int index, int channel, size_t pixel) const {
    const int high = plane(index, channel)[pixel];
    return low_ ? (high << low_bits_) + low_plane(index, channel)[pixel] : high;
  }

 private:
  const PlaneSlots *planes_, *low_ = nullptr;
  int first_slot_, size_, stride_ = 1, low_bits_ = 0;
};

}  // namespace qdmd
