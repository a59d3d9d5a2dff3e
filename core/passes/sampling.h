// SPDX-License-Identifier: LGPL-2.1-or-later
// Every k-th pixel in x and y of a picture.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// Every step-th row from `first` to before `end`, in rows of a plane.
struct SampledRows {
  int first, end, step;
};

// How many there are along a side, and in a picture.
constexpr size_t sample_count(int size, int step) {
  return static_cast<size_t>((size - 1) / step + 1);
}
constexpr size_t sample_count(int width, int height, int step) {
  return sample_count(width, step) * sample_count(height, step);
}

// Copies those of a plane of width * height samples, in row order.
inline void take_samples(const uint8_t* plane, int width, int height, int step, uint8_t* to) {
  for (int row = 0; row < height; row += step) {
    const uint8_t* from = plane + static_cast<ptrdiff_t>(row) * width;
    for (int col = 0; col < width; col += step) *to++ = from[col];
  }
}

}  // namespace qdmd
