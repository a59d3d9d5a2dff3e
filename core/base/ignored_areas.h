// SPDX-License-Identifier: LGPL-2.1-or-later
// Where nothing is foreground, and masks learn nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace qdmd {

// Pixels x .. x + width - 1 of rows y .. y + height - 1. Some or all may be outside of the picture.
struct Rectangle {
  int x = 0, y = 0, width = 0, height = 0;
};

// A few rectangles, which may overlap. It takes no memory of its own: each frame may have others.
class IgnoredAreas {
 public:
  static constexpr size_t kMost = 64;

  // False where the rectangle has no pixel, or there are kMost: it is left out then.
  bool add(const Rectangle& area);
  bool empty() const { return count_ == 0; }
  size_t size() const { return count_; }
  const Rectangle& operator[](size_t i) const { return areas_[i]; }

  // The same in a picture whose pixels stand for scale x scale of these: all that have a part in
  // some area are ignored.
  IgnoredAreas reduced(int scale) const;

  // How many rectangles have no pixel of a picture of width x height.
  unsigned outside(int width, int height) const;
  // Whether no pixel of such a picture is left.
  bool cover(int width, int height) const;

  // True where pixel (x, y) is ignored.
  bool has(int x, int y) const {
    bool any = false;
    visit(y, x, 1, [&](int64_t, int64_t) { any = true; });
    return any;
  }
  // Calls visit(begin, end) for runs left + begin .. left + end - 1 of row y that are ignored, of
  // columns left .. left + count - 1.
  template <typename Visit>
  void visit(int y, int left, int count, Visit visit) const {
    for (size_t i = 0; i < count_; ++i) {
      const Rectangle& area = areas_[i];
      // Corners may be anywhere: their sums need not be ints.
      if (y < area.y || y >= int64_t{area.y} + area.height) continue;
      const auto column = [&](int64_t x) { return std::clamp<int64_t>(x - left, 0, count); };
      const int64_t begin = column(area.x), end = column(int64_t{area.x} + area.width);
      if (begin < end) visit(begin, end);
    }
  }
  // Sets to 0 what is ignored of `count` samples of row y, from column `left` on.
  void clear(int y, int left, int count, uint8_t* samples) const;
  // clear() of samples first .. first + count - 1 of pictures that are `width` pixels wide.
  void clear_run(size_t first, size_t count, int width, uint8_t* samples) const;
  // clear() of whole rows first_row .. first_row + row_count - 1.
  void clear_rows(int first_row, int row_count, int width, uint8_t* picture) const;

 private:
  std::array<Rectangle, kMost> areas_;
  size_t count_ = 0;
};

}  // namespace qdmd
