// The median of some frames at a block of pixels, and how far they lie from it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// Frames of a median, and pixels of a block, at most.
constexpr int kMedianFrames = 15;
constexpr int kMedianBlock = 128;

// The block has `height` rows of `width` pixels. rows[3 i + c] is the first sample in frame i's
// channel c, whose rows are strides[3 i + c] apart, inverse[3 i + c] what its samples are
// multiplied by, of `count` frames. background[c]: the medians, the mean of the middle two, rounded
// up, where count is even. spread: the median of the quaternion distances from them, in steps of
// 1/4 level, up to 255; 0 for one frame. Rows of both are `stride` apart.
void median_block(const uint8_t* const* rows, const size_t* strides, const float* inverse,
                  size_t count, size_t width, size_t height, size_t stride,
                  uint8_t* const* background, uint8_t* spread);

}  // namespace qdmd
