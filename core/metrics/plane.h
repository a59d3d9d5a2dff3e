// SPDX-License-Identifier: LGPL-2.1-or-later
// One channel of numbers, and the channels that the measures of a background picture look at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/image_view.h"

namespace qdmd {

// width x height values in row order.
template <typename Value>
struct Plane {
  int width = 0, height = 0;
  std::vector<Value> values;

  Plane() = default;
  Plane(int width_, int height_)
      : width(width_),
        height(height_),
        values(static_cast<size_t>(width_) * static_cast<size_t>(height_)) {}

  Value& at(int x, int y) { return values[index(x, y)]; }
  const Value& at(int x, int y) const { return values[index(x, y)]; }

 private:
  size_t index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
};

// Luma of ITU-R BT.601 in 16..235, rounded half up:
// Y = 16 + (65.481 R + 128.553 G + 24.966 B) / 255.
Plane<uint8_t> luma(const ImageView& picture);

// The reversible colour transform of JPEG 2000 with the names of Yalman and Erturk (2013):
// Y' = floor((R + 2G + B) / 4), U' = R - G, V' = B - G. U' and V' are in -255..255.
struct ReversibleYuv {
  Plane<int> y, u, v;
};
ReversibleYuv reversible_yuv(const ImageView& picture);

// Throws std::invalid_argument that names both sizes, unless they are equal and not empty.
void require_same_size(int width, int height, int other_width, int other_height,
                       const std::string& what, const std::string& other);
template <typename Value>
void require_same_size(const Plane<Value>& a, const Plane<Value>& b) {
  require_same_size(a.width, a.height, b.width, b.height, "a picture", "the other one");
}

}  // namespace qdmd
