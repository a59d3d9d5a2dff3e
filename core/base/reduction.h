// SPDX-License-Identifier: LGPL-2.1-or-later
// How much smaller than its frames a picture is that masks are found in.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// A pixel of the smaller picture stands for scale x scale pixels of the frames, for fewer at the
// right and lower edges of sizes that are no multiple of it.
struct Reduction {
  int width = 0, height = 0;  // pixels of the frames
  int scale = 1;              // 1, 2 or 4

  static constexpr bool is_scale(int scale) { return scale == 1 || scale == 2 || scale == 4; }
  // Large pictures show more of the same things. Up to so many pixels masks are found in all of
  // them, up to eight times as many in a quarter, and beyond that in a sixteenth: 1920x1080 is
  // taken as it is, 3840x2160 is looked at in 1920x1080, and 7680x4320 is, too.
  static constexpr int automatic_scale(int width, int height) {
    constexpr int64_t kMost = 2'500'000;
    const int64_t pixels = int64_t{width} * height;
    return pixels <= kMost ? 1 : pixels <= 8 * kMost ? 2 : 4;
  }

  bool is_reduced() const { return scale > 1; }
  int small_width() const { return (width + scale - 1) / scale; }
  int small_height() const { return (height + scale - 1) / scale; }
  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  size_t small_pixels() const {
    return static_cast<size_t>(small_width()) * static_cast<size_t>(small_height());
  }
};

}  // namespace qdmd
