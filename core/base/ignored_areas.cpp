// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/base/ignored_areas.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace qdmd {

bool IgnoredAreas::add(const Rectangle& area) {
  if (area.width < 1 || area.height < 1 || count_ == kMost) return false;
  areas_[count_++] = area;
  return true;
}

IgnoredAreas IgnoredAreas::reduced(int scale) const {
  // Rounded down, below 0 too.
  const auto divided = [scale](int64_t value) {
    return value >= 0 ? value / scale : -((scale - 1 - value) / scale);
  };
  IgnoredAreas areas = *this;
  for (size_t i = 0; i < count_; ++i) {
    const auto side = [&](int first, int length, int* small_first, int* small_length) {
      const int64_t begin = divided(first), end = divided(int64_t{first} + length - 1) + 1;
      *small_first = static_cast<int>(begin);
      *small_length = static_cast<int>(end - begin);
    };
    Rectangle& area = areas.areas_[i];
    side(areas_[i].x, areas_[i].width, &area.x, &area.width);
    side(areas_[i].y, areas_[i].height, &area.y, &area.height);
  }
  return areas;
}

unsigned IgnoredAreas::outside(int width, int height) const {
  const auto begin = areas_.begin();
  return static_cast<unsigned>(std::count_if(begin, begin + count_, [&](const Rectangle& area) {
    return area.x >= width || area.y >= height || int64_t{area.x} + area.width <= 0 ||
           int64_t{area.y} + area.height <= 0;
  }));
}

bool IgnoredAreas::cover(int width, int height) const {
  std::vector<uint8_t> row(static_cast<size_t>(width));
  const auto covers_row = [&](int64_t y) {
    if (y < 0 || y >= height) return true;
    std::fill(row.begin(), row.end(), uint8_t{255});
    clear(static_cast<int>(y), 0, width, row.data());
    return std::count(row.begin(), row.end(), uint8_t{0}) == width;
  };
  // Rows differ from the one above only where a rectangle begins, or has ended.
  const auto begin = areas_.begin();
  return covers_row(0) && std::all_of(begin, begin + count_, [&](const Rectangle& area) {
           return covers_row(area.y) && covers_row(int64_t{area.y} + area.height);
         });
}

void IgnoredAreas::clear(int y, int left, int count, uint8_t* samples) const {
  visit(y, left, count, [&](int64_t begin, int64_t end) {
    std::memset(samples + begin, 0, static_cast<size_t>(end - begin));
  });
}

void IgnoredAreas::clear_run(size_t first, size_t count, int width, uint8_t* samples) const {
  if (empty()) return;
  const auto row = static_cast<size_t>(width);
  for (size_t done = 0; done < count;) {
    const size_t left = (first + done) % row, size = std::min(row - left, count - done);
    clear(static_cast<int>((first + done) / row), static_cast<int>(left), static_cast<int>(size),
          samples + done);
    done += size;
  }
}

void IgnoredAreas::clear_rows(int first_row, int row_count, int width, uint8_t* picture) const {
  const auto row = static_cast<size_t>(width);
  const size_t first = static_cast<size_t>(first_row) * row;
  clear_run(first, static_cast<size_t>(row_count) * row, width, picture + first);
}

}  // namespace qdmd
