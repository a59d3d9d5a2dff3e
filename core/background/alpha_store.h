// The alpha planes of a window's frames, kept only where they are not constant.
#pragma once

#include <cstdint>
#include <vector>

#include "core/background/image_view.h"

namespace qdmd {

// One entry a window slot. Video with alpha is nearly always opaque; such frames cost one byte.
class AlphaStore {
 public:
  explicit AlphaStore(int slots = 0) : entries_(static_cast<size_t>(slots)) {}

  // Remembers that all alpha samples of the frame in `slot` are `value`.
  void set_constant(int slot, uint8_t value);
  // Remembers the alpha samples of `frame`.
  void set(int slot, const ImageView& frame);
  // The samples in row order, or null where all are constant(slot).
  const uint8_t* samples(int slot) const {
    const Entry& entry = entries_[static_cast<size_t>(slot)];
    return entry.varies ? entry.samples.data() : nullptr;
  }
  uint8_t constant(int slot) const { return entries_[static_cast<size_t>(slot)].constant; }

 private:
  struct Entry {
    bool varies = false;
    uint8_t constant = 255;
    std::vector<uint8_t> samples;
  };
  std::vector<Entry> entries_;
};

// What the alpha samples of `frame` are if all are equal: its first one, 255 where it has none.
inline uint8_t first_alpha(const ImageView& frame) {
  return frame.alpha && !frame.alpha_is_padding ? *frame.alpha : uint8_t{255};
}

}  // namespace qdmd
