// SPDX-License-Identifier: LGPL-2.1-or-later
// Boxes around what moves, from a mask.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace qdmd {

struct Region {
  int x = 0, y = 0, width = 0, height = 0;  // pixels
  int area = 0;                             // masked pixels inside
  double mean_residual = 0;                 // of these, levels
};

// A strip along one edge of the picture, less than about 1/60 of its short side wide: the first
// rows or columns of something that comes in, which has a box with the next frames, or a rim that a
// camera's movement leaves.
bool is_strip_at_edge(const Region& region, int width, int height);

// Looks at one picture after another, with the same memory, which grows with what it finds.
class RegionFinder {
 public:
  static constexpr size_t kMostRegions = 64;

  RegionFinder();
  RegionFinder(RegionFinder&&) noexcept;
  RegionFinder& operator=(RegionFinder&&) noexcept;
  ~RegionFinder();

  // The regions of a picture of width x height pixels, the largest first, until the next call.
  // mask: 255 where foreground, else 0; residual: levels, or null where nobody asks. Parts nearer
  // to each other than about 1/60 of the short side are one region, and so are, unless they stay
  // `apart`, regions whose boxes overlap. Regions of fewer than least_area pixels are left out; 0:
  // 1/2000 of the picture, at least 4, and strips at an edge (is_strip_at_edge) unless they stay
  // apart. At most kMostRegions. Throws std::bad_alloc.
  const std::vector<Region>& find(const uint8_t* mask, const uint8_t* residual, int width,
                                  int height, int least_area, bool apart = false);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace qdmd
