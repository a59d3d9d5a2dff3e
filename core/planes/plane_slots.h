// SPDX-License-Identifier: LGPL-2.1-or-later
// Memory for the planes of many pictures of one size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/base/large_vector.h"
#include "core/base/page_file.h"
#include "core/planes/kept_picture.h"

namespace qdmd {

class Pool;

// `capacity` slots of a picture each. Planes start at multiples of 64 bytes and are padded with
// zeros, which add nothing to an inner product. In a slot are the three planes of the samples'
// highest eight bits and, where samples have more (`depth`, 8 to 16), three planes of the bits
// below.
class PlaneSlots {
 public:
  PlaneSlots() = default;
  // Throws std::bad_alloc. The pages are touched slot by slot, so a short stream in a long window
  // costs only what it fills.
  PlaneSlots(int capacity, size_t pixels, int depth = 8)
      : PlaneSlots(capacity, pixels, pixels, depth, {}) {}
  // Where the shape says so, channels 1 and 2 have their shared samples only. file: has bytes() of
  // the same, and becomes their place; or nothing.
  PlaneSlots(int capacity, const ChromaShape& shape, int depth = 8, PageFile file = {})
      : PlaneSlots(capacity, shape.pixels(), shape.samples(), depth, std::move(file)) {
    if (shape.is_shared()) shape_ = shape;
  }

  // The bytes that these constructors reserve.
  static uint64_t bytes(int capacity, size_t pixels, int depth = 8) {
    return bytes(capacity, pixels, pixels, depth);
  }
  static uint64_t bytes(int capacity, const ChromaShape& shape, int depth = 8) {
    return bytes(capacity, shape.pixels(), shape.samples(), depth);
  }
  // Of memory: none where they lie in a file.
  uint64_t bytes() const { return on_disk() ? 0 : reserved_; }

  int capacity() const { return capacity_; }
  int depth() const { return depth_; }
  size_t pixels() const { return pixels_; }
  size_t plane_size() const { return plane_size_; }
  // Where no samples are shared, it is nothing.
  const ChromaShape& shape() const { return shape_; }

  // The highest eight bits of a channel, and all bits.
  const uint8_t* plane(int slot, int channel) const { return data() + offset(slot, channel); }
  uint8_t* plane(int slot, int channel) { return data() + offset(slot, channel); }
  Samples samples(int slot, int channel) const {
    return samples_in(plane(slot, channel), digit_size(), depth_);
  }
  MutableSamples samples(int slot, int channel) {
    return samples_in(plane(slot, channel), digit_size(), depth_);
  }
  KeptPicture picture(int slot) const {
    const Samples planes[] = {samples(slot, 0), samples(slot, 1), samples(slot, 2)};
    return {planes, shape_, depth_};
  }
  bool on_disk() const { return file_.data() != nullptr; }
  // This slot is about to be written: takes the memory of slots up to it on all threads of the
  // pool, and no more than four large pages beyond it. Null, or never called: pages are taken as
  // they are written. In a file, what the slot held is forgotten.
  void take_pages(int slot, Pool* pool);
  // Where planes lie in a file: those of a slot stay as they are for a while; they are read soon;
  // `count` pixels of them, 1 at least, from `first` on are.
  void written(int slot) const;
  void will_need(int slot) const;
  void will_need(int slot, size_t first, size_t count) const;
  // Zeros behind the samples of a slot's planes, whose first ones, as many as a plane has, the
  // caller fills.
  void pad(int slot);

  // From now on planes have `pixels` samples, at most as many as memory was taken for. What they
  // hold is lost.
  void resize(size_t pixels);

 private:
  PlaneSlots(int capacity, size_t pixels, size_t chroma_samples, int depth, PageFile file);
  static uint64_t bytes(int capacity, size_t pixels, size_t chroma_samples, int depth);
  uint8_t* data() const { return on_disk() ? file_.data() : memory_.get(); }
  // The bytes of a slot's planes of the highest eight bits.
  size_t digit_size() const { return plane_size_ + 2 * chroma_size_; }
  uint64_t slot_size() const { return offset(1, 0); }
  size_t offset(int slot, int channel) const {
    const size_t before = channel == 0 ? 0 : plane_size_ + (channel == 2 ? chroma_size_ : 0);
    return static_cast<size_t>(slot * sample_bytes(depth_)) * digit_size() + before;
  }

  int capacity_ = 0, depth_ = 8;
  size_t pixels_ = 0, plane_size_ = 0, chroma_samples_ = 0, chroma_size_ = 0;
  ChromaShape shape_;
  uint64_t reserved_ = 0, taken_ = 0;
  std::unique_ptr<uint8_t[], GiveBackLarge> memory_;
  PageFile file_;
};

}  // namespace qdmd
