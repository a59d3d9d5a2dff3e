#include "core/background/alpha_store.h"

namespace qdmd {

void AlphaStore::set_constant(int slot, uint8_t value) {
  Entry& entry = entries_[static_cast<size_t>(slot)];
  entry.varies = false;
  entry.constant = value;
}

void AlphaStore::set(int slot, const ImageView& frame) {
  Entry& entry = entries_[static_cast<size_t>(slot)];
  entry.varies = true;
  entry.samples.resize(static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height));
  uint8_t* to = entry.samples.data();
  for (int row = 0; row < frame.height; ++row) {
    const uint8_t* from = frame.alpha + row * frame.row_stride;
    for (int col = 0; col < frame.width; ++col, from += frame.pixel_stride) *to++ = *from;
  }
}

}  // namespace qdmd
