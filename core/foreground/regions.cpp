// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/regions.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "core/foreground/mask_runs.h"
#include "core/foreground/parts.h"

namespace qdmd {
namespace {

bool overlap(const Region& a, const Region& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

Region merged(const Region& a, const Region& b) {
  Region both;
  both.x = std::min(a.x, b.x);
  both.y = std::min(a.y, b.y);
  both.width = std::max(a.x + a.width, b.x + b.width) - both.x;
  both.height = std::max(a.y + a.height, b.y + b.height) - both.y;
  both.area = a.area + b.area;
  both.mean_residual = (a.area * a.mean_residual + b.area * b.mean_residual) / both.area;
  return both;
}

// Each region swallows those that it overlaps, until none does.
void merge_overlapping(std::vector<Region>* regions) {
  for (size_t i = 0; i < regions->size();) {
    const auto other =
        std::find_if(regions->begin() + static_cast<ptrdiff_t>(i) + 1, regions->end(),
                     [&](const Region& r) { return overlap((*regions)[i], r); });
    if (other == regions->end()) {
      ++i;
      continue;
    }
    (*regions)[i] = merged((*regions)[i], *other);
    regions->erase(other);
    // It has grown: those before may overlap it now.
    i = 0;
  }
}

// Pixels that are less than this apart are near to each other.
int reach_of(int width, int height) {
  return 2 * std::max(1, static_cast<int>(std::lround(std::min(width, height) / 120.0))) + 1;
}

// The largest first; of equals the one that begins further up, or further to the left.
bool comes_before(const Region& a, const Region& b) {
  return std::tuple(-a.area, a.y, a.x) < std::tuple(-b.area, b.y, b.x);
}

// Foreground pixels of a row that are near to each other, or of all rows of a part.
struct Pixels {
  // right and bottom are one beyond: so what is at most `reach` apart has less than `reach`
  // between.
  int left = INT32_MAX, right = 0, top = INT32_MAX, bottom = 0;
  int area = 0;
  int64_t residual = 0;

  void add(const Pixels& other) {
    left = std::min(left, other.left);
    right = std::max(right, other.right);
    top = std::min(top, other.top);
    bottom = std::max(bottom, other.bottom);
    area += other.area;
    residual += other.residual;
  }
};

}  // namespace

bool is_strip_at_edge(const Region& r, int width, int height) {
  const int reach = reach_of(width, height);
  const bool left = r.x == 0, right = r.x + r.width == width;
  const bool top = r.y == 0, bottom = r.y + r.height == height;
  return (r.width < reach && left != right) || (r.height < reach && top != bottom);
}

struct RegionFinder::Memory {
  // Pixels of a row, from left to right, of which each is at most `reach` right of the one before.
  // If the spans of two are at most `reach` apart, so are two of their pixels: the end of one lies
  // beside the other, or in one of its gaps.
  std::vector<Pixels> stretches;
  std::vector<size_t> rows;   // where each row's stretches begin
  std::vector<size_t> named;  // by each stretch, another one of its part (parts.h)
  std::vector<Region> regions;

  size_t find_part(size_t stretch) {
    return part_of(stretch, [this](size_t i) -> size_t& { return named[i]; });
  }
  void find_stretches(const uint8_t* mask, const uint8_t* residual, int width, int y, int reach);
  void join_rows(int above, int below, int reach);
};

// Adds those of row y.
void RegionFinder::Memory::find_stretches(const uint8_t* mask, const uint8_t* residual, int width,
                                          int y, int reach) {
  const size_t first = stretches.size();
  rows.push_back(first);
  for (int begin = next_of(mask, 0, width, 255), end; begin < width;
       begin = next_of(mask, end, width, 255)) {
    end = next_of(mask, begin, width, 0);
    const int64_t sum =
        residual ? std::accumulate(residual + begin, residual + end, int64_t{0}) : 0;
    const Pixels run = {begin, end, y, y + 1, end - begin, sum};
    if (stretches.size() > first && begin - stretches.back().right < reach) {
      stretches.back().add(run);
      continue;
    }
    named.push_back(stretches.size());
    stretches.push_back(run);
  }
}

void RegionFinder::Memory::join_rows(int above, int below, int reach) {
  const auto end_of = [&](int y) { return rows[static_cast<size_t>(y) + 1]; };
  size_t a = rows[static_cast<size_t>(above)], b = rows[static_cast<size_t>(below)];
  while (a < end_of(above) && b < end_of(below)) {
    const Pixels &upper = stretches[a], &lower = stretches[b];
    if (lower.left - upper.right < reach && upper.left - lower.right < reach)
      named[find_part(b)] = find_part(a);
    // What ends first is near to no other one of the next.
    ++(upper.right < lower.right ? a : b);
  }
}

RegionFinder::RegionFinder() = default;
RegionFinder::RegionFinder(RegionFinder&&) noexcept = default;
RegionFinder& RegionFinder::operator=(RegionFinder&&) noexcept = default;
RegionFinder::~RegionFinder() = default;

const std::vector<Region>& RegionFinder::find(const uint8_t* mask, const uint8_t* residual,
                                              int width, int height, int least_area, bool apart) {
  if (!memory_) memory_ = std::make_unique<Memory>();
  auto& [stretches, rows, named, regions] = *memory_;
  stretches.clear(), rows.clear(), named.clear(), regions.clear();
  const int reach = reach_of(width, height);
  for (int y = 0; y < height; ++y) {
    const size_t first = static_cast<size_t>(y) * static_cast<size_t>(width);
    memory_->find_stretches(mask + first, residual ? residual + first : nullptr, width, y, reach);
  }
  rows.push_back(stretches.size());
  for (int y = 1; y < height; ++y)
    for (int above = std::max(0, y - reach); above < y; ++above)
      memory_->join_rows(above, y, reach);
  for (size_t k = 0; k < stretches.size(); ++k)
    if (const size_t part = memory_->find_part(k); part != k) stretches[part].add(stretches[k]);

  const double least =
      least_area > 0 ? least_area : std::max(4.0, static_cast<double>(width) * height / 2000);
  for (size_t k = 0; k < stretches.size(); ++k) {
    const Pixels& part = stretches[k];
    if (named[k] != k || part.area < least) continue;
    regions.push_back({part.left, part.top, part.right - part.left, part.bottom - part.top,
                       part.area, static_cast<double>(part.residual) / part.area});
  }
  std::sort(regions.begin(), regions.end(), comes_before);
  if (regions.size() > kMostRegions) regions.resize(kMostRegions);
  if (apart) return regions;
  merge_overlapping(&regions);
  if (least_area == 0)
    std::erase_if(regions, [&](const Region& r) { return is_strip_at_edge(r, width, height); });
  std::sort(regions.begin(), regions.end(), comes_before);
  return regions;
}

}  // namespace qdmd
