// SPDX-License-Identifier: LGPL-2.1-or-later
// A view of a picture whose memory belongs to others.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// How the samples of one channel lie: the sample of pixel (x, y) is y / rows * row_stride +
// x / columns * pixel_stride bytes behind the channel's first one.
struct Spacing {
  ptrdiff_t pixel_stride = 0, row_stride = 0;  // bytes
  int columns = 1, rows = 1;                   // of pixels that share a sample: 1 or 2

  bool operator==(const Spacing&) const = default;
};

// How many of a sample's bits count, and where they are.
struct SampleBits {
  // 8: a sample is a byte. 9 to 16: it is a little-endian word at any address, and lies `shift`
  // bits above the word's lowest; the bits around it are not read and are written as 0.
  int depth = 8, shift = 0;

  bool operator==(const SampleBits&) const = default;
  bool is_deep() const { return depth > 8; }
  // Bits below the highest eight.
  int low() const { return depth - 8; }
  int most() const { return (1 << depth) - 1; }
};

// Samples of three channels (R, G, B or Y, U, V) and perhaps of alpha: one type covers every
// packed, planar or half-planar layout with any padding. Pointers are to the first sample of each
// channel. In Y, U and V each chroma sample stands for the pixels that share it.
template <typename Byte>
struct BasicImageView {
  Byte* channel[3] = {nullptr, nullptr, nullptr};
  Byte* alpha = nullptr;  // null: the format has none
  SampleBits bits;        // of all samples, those of alpha included
  // True: samples at `alpha` are padding; they are not read and are written as 255.
  bool alpha_is_padding = false;
  int width = 0, height = 0;
  // Distances in all channels, and in alpha, unless they have a spacing of their own.
  ptrdiff_t pixel_stride = 0, row_stride = 0;  // bytes
  // The own spacing of channels 0 to 2 and of alpha (3); none if its pixel_stride is 0.
  Spacing own[4];

  Spacing spacing(int c) const {
    return own[c].pixel_stride != 0 ? own[c] : Spacing{pixel_stride, row_stride, 1, 1};
  }
  // True if no channel has a spacing of its own.
  bool is_even() const {
    for (const Spacing& spacing : own)
      if (spacing.pixel_stride != 0) return false;
    return true;
  }
};

using ImageView = BasicImageView<const uint8_t>;
using MutableImageView = BasicImageView<uint8_t>;

}  // namespace qdmd
