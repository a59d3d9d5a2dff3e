// SPDX-License-Identifier: LGPL-2.1-or-later
// The median of some frames at a block of pixels, and how far they lie from it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/channels.h"

namespace qdmd {

// Frames of a median, and pixels of a block, at most.
constexpr int kMedianFrames = 15;
constexpr int kMedianBlock = 128;

// A block of a picture, of `width` x `height` <= kMedianBlock pixels. In frames where pixels share
// samples of channels 1 and 2, `columns` x `rows` do; the first of these samples has `left` columns
// and `top` rows of pixels outside the block.
struct MedianBlock {
  size_t width, height;
  size_t columns = 1, rows = 1, left = 0, top = 0;

  size_t shared_width() const { return (left + width + columns - 1) / columns; }
  size_t shared_height() const { return (top + height + rows - 1) / rows; }
};

// What a frame has at a block, in each channel: the first sample, how far its rows are apart, and
// what becomes of the samples.
struct MedianFrame {
  const uint8_t* first[kChannels];
  size_t stride[kChannels];
  LevelMap map[kChannels];
  bool is_shared = false;

  void take_out(const SampleLight& light) {
    for (size_t c = 0; c < kChannels; ++c) map[c] = light.back(c);
  }
};

// The medians of `count` <= kMedianFrames frames. background[c]: these, the mean of the middle two,
// rounded up, where count is even. spread: the median of the quaternion distances from them, in
// steps of 1/4 level, up to 255; 0 for one frame. Both are of pixels, rows of them `stride` apart.
void median_block(const MedianBlock& block, const MedianFrame* frames, size_t count, size_t stride,
                  uint8_t* const* background, uint8_t* spread);

}  // namespace qdmd
