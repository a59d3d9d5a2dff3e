// How far each pixel is from the background while it is background.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace qdmd {

// A mean distance of each pixel, in 1/256 level, which follows the newest frames
// (learn_distance()).
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

}  // namespace qdmd
