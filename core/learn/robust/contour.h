// SPDX-License-Identifier: LGPL-2.1-or-later
// What stands before what: two looks of a region are told apart by the contour around it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/near_cells.h"
#include "core/passes/grid.h"

namespace qdmd {

using steps::contours::kLeastRegion, steps::contours::kLooksDiffer;

// Two looks of a cell differ.
inline bool differs_at(const float* const a[3], const float* const b[3], size_t cell) {
  float sum = 0;
  for (int c = 0; c < kChannels; ++c) sum += std::abs(a[c][cell] - b[c][cell]);
  return sum > kChannels * kLooksDiffer;
}

// Regions of connected cells, diagonals included.
class CellRegions {
 public:
  explicit CellRegions(const Grid& grid) : grid_(grid), region_of_(grid.cells()) {}

  // The regions of cells where `inside` is set, each a list of cells.
  const std::vector<std::vector<int>>& find(const std::vector<uint8_t>& inside) {
    regions_.clear();
    std::fill(region_of_.begin(), region_of_.end(), -1);
    for (size_t cell = 0; cell < inside.size(); ++cell) {
      if (!inside[cell] || region_of_[cell] >= 0) continue;
      const int id = static_cast<int>(regions_.size());
      auto& region = regions_.emplace_back();
      region.push_back(static_cast<int>(cell));
      region_of_[cell] = id;
      for (size_t next = 0; next < region.size(); ++next)
        each_near(grid_, region[next], 1, [&](int near) {
          const auto neighbour = static_cast<size_t>(near);
          if (!inside[neighbour] || region_of_[neighbour] >= 0) return;
          region_of_[neighbour] = id;
          region.push_back(near);
        });
    }
    return regions_;
  }
  bool in(int region, int cell) const { return region_of_[static_cast<size_t>(cell)] == region; }

 private:
  const Grid& grid_;
  std::vector<int> region_of_;
  std::vector<std::vector<int>> regions_;
};

// The strength of a picture's edges along a region's border: differences of the cells on both sides
// of each border cell, a channel's mean.
class Contour {
 public:
  Contour(const Grid& grid, const CellRegions& regions, int region, const std::vector<int>& cells) {
    const auto note = [&](int before, int after) {
      if (regions.in(region, before) != regions.in(region, after))
        pairs_.emplace_back(before, after);
    };
    // Each pair of cells two apart, of which one is inside, is met from its inside one.
    for (int cell : cells) {
      const int y = cell / grid.cols, x = cell % grid.cols;
      if (y + 2 < grid.rows) note(cell, cell + 2 * grid.cols);
      if (y >= 2) note(cell - 2 * grid.cols, cell);
      if (x + 2 < grid.cols) note(cell, cell + 2);
      if (x >= 2) note(cell - 2, cell);
    }
  }
  // True where it is so much weaker in a picture's planes `a` than in `b` that what `b` shows
  // stands before what `a` shows.
  bool is_weaker(const float* const a[3], const float* const b[3]) const {
    using namespace steps::contours;
    return pairs_.size() >= kLeastPairs && strength(b) > kMargin * strength(a) + kMoreLevels;
  }

 private:
  float strength(const float* const planes[3]) const {
    double sum = 0;
    for (const auto& [a, b] : pairs_) {
      float d = 0;
      for (int c = 0; c < kChannels; ++c) d += std::abs(planes[c][a] - planes[c][b]);
      sum += std::min(d / 3, steps::contours::kMostEdge);
    }
    return static_cast<float>(sum / static_cast<double>(pairs_.size()));
  }

  std::vector<std::pair<int, int>> pairs_;
};

}  // namespace qdmd
