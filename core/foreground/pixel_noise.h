// How far each pixel is from the background while it is background.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace qdmd {

// A mean distance of each pixel, in 1/256 level, which follows the newest frames.
class PixelNoise {
 public:
  // Takes all memory. For pictures of width x height pixels.
  PixelNoise(int width, int height)
      : width_(static_cast<size_t>(width)), mean_(width_ * static_cast<size_t>(height)) {}
  static uint64_t bytes(int width, int height) {
    return sizeof(uint16_t) * static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
  }

  void forget() { std::fill(mean_.begin(), mean_.end(), uint16_t{0}); }
  // Of a row of pixels.
  uint16_t* row(int y) { return mean_.data() + static_cast<size_t>(y) * width_; }

 private:
  size_t width_;
  std::vector<uint16_t> mean_;
};

// Moves `count` means by `share` of the way, 0 to 1, towards distances whose squares are given, at
// most kMostNoise levels; where learns[p] is 0, not.
constexpr float kMostNoise = 100;
void learn_noise(const uint16_t* squared, const uint8_t* learns, int count, float share,
                 uint16_t* mean);

// limit[p] = the larger of limit[p] and `factor` / 256 of the mean, in levels, at most 255.
void raise_limit(const uint16_t* mean, int factor, int count, uint8_t* limit);

}  // namespace qdmd
