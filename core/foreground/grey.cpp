// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/grey.h"

#include <algorithm>
#include <cstdlib>

namespace qdmd {

bool is_grey(const uint8_t* const x[3], size_t width, size_t height, Colours colours,
             const uint8_t neutral[3]) {
  if (colours == Colours::grey) return true;
  constexpr size_t kAlong = 40;  // samples
  constexpr int kMost = 3;
  const size_t step_x = std::max<size_t>(1, width / kAlong),
               step_y = std::max<size_t>(1, height / kAlong);
  const size_t all = (width + step_x - 1) / step_x * ((height + step_y - 1) / step_y);
  size_t coloured = 0;
  // Most videos have enough colours in their first rows.
  for (size_t row = 0; row < height && 200 * coloured <= all; row += step_y)
    for (size_t p = row * width; p < (row + 1) * width; p += step_x) {
      const int a = x[0][p], b = x[1][p], c = x[2][p];
      const int away = colours == Colours::yuv
                           ? std::max(std::abs(b - neutral[1]), std::abs(c - neutral[2]))
                           : std::max({a, b, c}) - std::min({a, b, c});
      coloured += away > kMost;
    }
  return 200 * coloured <= all;
}

}  // namespace qdmd
