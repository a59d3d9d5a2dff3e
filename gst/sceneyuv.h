// SPDX-License-Identifier: LGPL-2.1-or-later
// Writes R, G and B of a scene as Y, U and V, or grey, of whatever depth, range and matrix.
#pragma once

#include <gst/video/video.h>

#include <cstdint>
#include <functional>
#include <vector>

namespace qdmd {

// From integers to integers, so that a picture is the same on every machine. A chroma sample is
// that of the mean colour of the pixels that share it.
class SceneYuv {
 public:
  // For frames of Y, U, V or grey, of 8 to 16 bits.
  explicit SceneYuv(const GstVideoInfo& info);

  // row(y): 3 width samples of R, G and B, each of which may be overwritten by the next call.
  void write(GstVideoFrame* frame, const std::function<const uint8_t*(int y)>& row);

 private:
  // A sample is (offset + r R + g G + b B) / 65536, rounded down; the offset has the half of it.
  struct Weights {
    int64_t offset = 0, r = 0, g = 0, b = 0;
  };
  Weights weights_[3];
  std::vector<int> sums_;  // of the colours of pixels that share a sample, a row of them
};

}  // namespace qdmd
