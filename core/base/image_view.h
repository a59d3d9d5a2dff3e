// A picture in somebody else's memory.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// 8-bit R, G, B and perhaps A samples at a fixed pixel and row distance, so that one type covers
// every packed or planar layout with any padding. Pointers are to the first sample of each channel.
template <typename Byte>
struct BasicImageView {
  Byte* channel[3] = {nullptr, nullptr, nullptr};  // R, G, B
  Byte* alpha = nullptr;                           // null: the format has none
  // True: samples at `alpha` are padding; they are not read and are written as 255.
  bool alpha_is_padding = false;
  int width = 0, height = 0;
  ptrdiff_t pixel_stride = 0, row_stride = 0;  // bytes
};

using ImageView = BasicImageView<const uint8_t>;
using MutableImageView = BasicImageView<uint8_t>;

}  // namespace qdmd
