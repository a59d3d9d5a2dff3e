// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/edges.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/foreground/mask_runs.h"

namespace qdmd {
namespace {

// What is inside has so many pixels of the mask on all sides. Every second pixel up to so far away,
// along rows and columns, says what the thing's colour is.
constexpr int kDepth = 2, kReach = 3;

// x - L of a pixel.
struct Difference {
  int64_t of[3];

  Difference(const EdgeView& view, int x, int y) {
    const ComparedPlanes& planes = view.planes;
    const size_t at = static_cast<size_t>(y) * planes.x_stride + static_cast<size_t>(x),
                 of_l = static_cast<size_t>(y) * planes.l_stride + static_cast<size_t>(x);
    for (int c = 0; c < 3; ++c) of[c] = int64_t{planes.x[c][at]} - planes.l[c][of_l];
  }
};

// The sum of x - L of pixels inside near a pixel of the edge, and how many these are.
struct InsideSum {
  int64_t of[3] = {}, count = 0;
};

InsideSum sum_inside(const EdgeView& view, int x, int y) {
  InsideSum sum;
  for (int row = y - kReach; row <= y + kReach; row += 2) {
    if (row < 0 || row >= view.height) continue;
    const uint8_t* const inside = view.inside + static_cast<size_t>(row) * view.planes.l_stride;
    for (int col = x - kReach; col <= x + kReach; col += 2) {
      if (col < 0 || col >= view.width || !inside[col]) continue;
      const Difference difference(view, col, row);
      for (int c = 0; c < 3; ++c) sum.of[c] += difference.of[c];
      ++sum.count;
    }
  }
  return sum;
}

uint64_t eight_of(const uint8_t* at) {
  uint64_t eight;
  std::memcpy(&eight, at, sizeof eight);
  return eight;
}

// The sum of four lanes of 16 bits, below 2^16.
int64_t sum_of_lanes(uint64_t lanes) {
  return static_cast<int64_t>(lanes * 0x0001000100010001u >> 48);
}

// The same four samples of a row at a time, where all of the eight from x - kReach on are in the
// picture: a row's four are in lanes of 16 bits, which have room for all rows.
InsideSum sum_inside_quickly(const EdgeView& view, int x, int y) {
  static_assert(kReach == 3);
  constexpr uint64_t kEverySecond = 0x00ff00ff00ff00ffu;
  uint64_t of_x[3] = {}, of_l[3] = {}, count = 0;
  const int first = std::max(y - kReach, (y - kReach) & 1),
            last = std::min(y + kReach, view.height - 1);
  for (int row = first; row <= last; row += 2) {
    const auto left = static_cast<size_t>(x - kReach);
    const size_t at = static_cast<size_t>(row) * view.planes.x_stride + left,
                 of_level = static_cast<size_t>(row) * view.planes.l_stride + left;
    const uint64_t inside = eight_of(view.inside + of_level) & kEverySecond;
    if (inside == 0) continue;
    count += inside & 0x0001000100010001u;
    for (int c = 0; c < 3; ++c) {
      of_x[c] += eight_of(view.planes.x[c] + at) & inside;
      of_l[c] += eight_of(view.planes.l[c] + of_level) & inside;
    }
  }
  InsideSum sum;
  sum.count = sum_of_lanes(count);
  for (int c = 0; c < 3; ++c) sum.of[c] = sum_of_lanes(of_x[c]) - sum_of_lanes(of_l[c]);
  return sum;
}

bool is_background(const EdgeView& view, const EdgeConstants& constants, int x, int y) {
  const bool quick = std::endian::native == std::endian::little && x >= kReach &&
                     x - kReach + static_cast<int>(sizeof(uint64_t)) <= view.width;
  const auto [sum, count] = quick ? sum_inside_quickly(view, x, y) : sum_inside(view, x, y);
  if (count == 0) return false;
  // Whole numbers, so that the answer is the same everywhere: with S = count (F - L) all products
  // are below 2^63.
  const Difference own(view, x, y);
  int64_t own_sum = 0, own_own = 0, sum_sum = 0;
  for (int c = 0; c < 3; ++c) {
    own_sum += own.of[c] * sum[c];
    own_own += own.of[c] * own.of[c];
    sum_sum += sum[c] * sum[c];
  }
  const auto all = static_cast<double>(sum_sum), of_count = static_cast<double>(count);
  if (static_cast<double>(own_sum) * of_count >= constants.half * all) return false;
  const auto left_over = static_cast<double>(own_own * sum_sum - own_sum * own_sum);
  return left_over * of_count * of_count <= constants.rest * constants.rest * all * all;
}

}  // namespace

void find_inside(const EdgeView& view, int first_row, int rows) {
  const auto row_of = [&](int y) {
    return view.mask + static_cast<size_t>(y) * static_cast<size_t>(view.width);
  };
  for (int y = first_row; y < first_row + rows; ++y) {
    uint8_t* const inside = view.inside + static_cast<size_t>(y) * view.planes.l_stride;
    for (int left = 0; left < view.width; left += kMaskBlock) {
      const int count = std::min(kMaskBlock, view.width - left);
      if (!copy_if_any(row_of(y) + left, count, inside + left)) continue;
      // With the columns beside the block.
      uint8_t column[kMaskBlock + 2 * kDepth];
      std::fill_n(column, sizeof column, uint8_t{255});
      for (int row = std::max(y - kDepth, 0); row <= std::min(y + kDepth, view.height - 1); ++row) {
        const uint8_t* const from = row_of(row) + left - kDepth;
        if (left >= kDepth && left + kMaskBlock + kDepth <= view.width) {
          for (size_t i = 0; i < sizeof column; ++i) column[i] &= from[i];
          continue;
        }
        const int end = std::min(left + count + kDepth, view.width) - left + kDepth;
        for (int i = std::max(kDepth - left, 0); i < end; ++i) column[i] &= from[i];
      }
      for (int p = 0; p < count; ++p) {
        uint8_t all = 255;
        for (int i = 0; i <= 2 * kDepth; ++i) all &= column[p + i];
        inside[left + p] = all;
      }
    }
  }
}

void fit_edges(const EdgeView& view, const EdgeConstants& constants, int first_row, int rows,
               uint8_t* out) {
  const auto row_of = [&](int y) {
    return view.mask +
           static_cast<size_t>(std::clamp(y, 0, view.height - 1)) * static_cast<size_t>(view.width);
  };
  for (int y = first_row; y < first_row + rows; ++y) {
    uint8_t* const to = out + static_cast<size_t>(y) * view.planes.l_stride;
    const uint8_t *const above = row_of(y - 1), *const own = row_of(y),
                         *const below = row_of(y + 1);
    for (int left = 0; left < view.width; left += kMaskBlock) {
      const int count = std::min(kMaskBlock, view.width - left);
      if (!copy_if_any(own + left, count, to + left)) continue;
      uint8_t row[kMaskBlock + 2], edge[kMaskBlock];
      std::memcpy(row + 1, own + left, static_cast<size_t>(count));
      row[0] = left > 0 ? own[left - 1] : 255;
      row[count + 1] = left + count < view.width ? own[left + count] : 255;
      for (int p = 0; p < count; ++p)
        edge[p] = static_cast<uint8_t>(row[p + 1] &
                                       ~(row[p] & row[p + 2] & above[left + p] & below[left + p]));
      for (int p = next_of(edge, 0, count, 255); p < count; p = next_of(edge, p + 1, count, 255))
        if (is_background(view, constants, left + p, y)) to[left + p] = 0;
    }
  }
}

}  // namespace qdmd
