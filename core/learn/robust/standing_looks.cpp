#include "core/learn/robust/standing_looks.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace qdmd {
namespace {

// A cell shows the same as long as it is within so many levels, sum of the channels: noise of
// cells' means is far below.
constexpr float kSame = 12;
// What a frame counts in a look, at least.
constexpr float kShare = 0.1f;
constexpr int kLook = 0, kNext = 1, kBefore = 2;

}  // namespace

StandingLooks::StandingLooks(const Grid& grid)
    : grid_(grid), looks_(grid, 3), cells_(grid.cells()), differs_(grid.cells()) {
  found_.reserve(grid.cells());
}

uint64_t StandingLooks::bytes(const Grid& grid) {
  return GridFrames::bytes(grid, 3) + grid.cells() * (sizeof(Cell) + sizeof(uint8_t) + sizeof(int));
}

void StandingLooks::forget() { std::fill(cells_.begin(), cells_.end(), Cell()); }

void StandingLooks::follow(const float* const frame[3], const Gain& gain, int64_t number) {
  number_ = number;
  const Gain inverse = {1 / gain[0], 1 / gain[1], 1 / gain[2]};
  float* const look[3] = {looks_.plane(kLook, 0), looks_.plane(kLook, 1), looks_.plane(kLook, 2)};
  float* const next[3] = {looks_.plane(kNext, 0), looks_.plane(kNext, 1), looks_.plane(kNext, 2)};
  for (size_t at = 0; at < cells_.size(); ++at) {
    Cell& cell = cells_[at];
    float level[3], from_look = 0;
    for (size_t c = 0; c < kChannels; ++c) {
      level[c] = frame[c][at] * inverse[c];
      from_look += std::abs(level[c] - look[c][at]);
    }
    const auto add = [&](float* const levels[3], Look* to, float least_share) {
      ++to->frames;
      to->last = number;
      // No division where it is known which one is more.
      const float share = static_cast<float>(to->frames) * least_share >= 2
                              ? least_share
                              : std::max(least_share, 1 / static_cast<float>(to->frames));
      for (size_t c = 0; c < kChannels; ++c) levels[c][at] += share * (level[c] - levels[c][at]);
    };
    if (cell.look.frames > 0 && from_look < kSame) {
      add(look, &cell.look, kShare);
      cell.next = {};
      continue;
    }
    float from_next = 0;
    for (size_t c = 0; c < kChannels; ++c) from_next += std::abs(level[c] - next[c][at]);
    if (cell.next.frames == 0 || from_next >= kSame) cell.next = {number, number, 0};
    add(next, &cell.next, 0);
    if (cell.next.frames == kSteady) take_next(at);
  }
}

void StandingLooks::take_next(size_t at) {
  Cell& cell = cells_[at];
  float from_before = 0;
  for (int c = 0; c < kChannels; ++c)
    from_before += std::abs(looks_.plane(kNext, c)[at] - looks_.plane(kBefore, c)[at]);
  const Look before = std::exchange(cell.before, cell.look);
  cell.look = std::exchange(cell.next, Look());
  if (before.frames > 0 && from_before < kSame &&
      cell.look.since - before.last <= before.last - before.since)
    cell.look.since = before.since;
  for (int c = 0; c < kChannels; ++c) {
    looks_.plane(kBefore, c)[at] = looks_.plane(kLook, c)[at];
    looks_.plane(kLook, c)[at] = looks_.plane(kNext, c)[at];
  }
}

const std::vector<int>& StandingLooks::uncovered(const float* const background[3]) {
  found_.clear();
  news_ = 0;
  if (std::min(grid_.rows, grid_.cols) < 4) return found_;
  const float* const look[3] = {looks_.plane(kLook, 0), looks_.plane(kLook, 1),
                                looks_.plane(kLook, 2)};
  size_t count = 0;
  for (size_t cell = 0; cell < grid_.cells(); ++cell) {
    differs_[cell] = differs_at(look, background, cell) && shows(cell);
    count += differs_[cell];
    news_ += differs_[cell] && number_ - cells_[cell].look.since < kNewsFrames;
  }
  if (count < kLeastRegion) return found_;
  CellRegions regions(grid_);
  const auto& found = regions.find(differs_);
  for (size_t region = 0; region < found.size(); ++region)
    if (found[region].size() >= kLeastRegion &&
        Contour(grid_, regions, static_cast<int>(region), found[region])
            .is_weaker(look, background))
      found_.insert(found_.end(), found[region].begin(), found[region].end());
  return found_;
}

const std::vector<int>& StandingLooks::stood(const float* const background[3], int64_t frames) {
  found_.clear();
  const float* const look[3] = {looks_.plane(kLook, 0), looks_.plane(kLook, 1),
                                looks_.plane(kLook, 2)};
  const auto ripe = [&](size_t cell) { return number_ - cells_[cell].look.since >= frames; };
  // Few cells differ: what else is known of a cell is looked at there only.
  for (size_t cell = 0; cell < grid_.cells(); ++cell) {
    float sum = 0;
    for (int c = 0; c < kChannels; ++c) sum += std::abs(look[c][cell] - background[c][cell]);
    differs_[cell] = sum >= kSame;
  }
  bool any = false;
  for (size_t cell = 0; cell < grid_.cells(); ++cell) {
    if (!differs_[cell]) continue;
    differs_[cell] = shows(cell);
    any |= differs_[cell] && ripe(cell);
  }
  if (!any) return found_;
  CellRegions regions(grid_);
  for (const std::vector<int>& region : regions.find(differs_)) {
    const auto ripe_cells = std::count_if(
        region.begin(), region.end(), [&](int cell) { return ripe(static_cast<size_t>(cell)); });
    if (2 * static_cast<size_t>(ripe_cells) < region.size()) continue;
    for (int cell : region) {
      const int y = cell / grid_.cols, x = cell % grid_.cols;
      for (int yy = std::max(0, y - 1); yy <= std::min(grid_.rows - 1, y + 1); ++yy)
        for (int xx = std::max(0, x - 1); xx <= std::min(grid_.cols - 1, x + 1); ++xx) {
          const int near = yy * grid_.cols + xx;
          if (near == cell ||
              (!differs_[static_cast<size_t>(near)] && shows(static_cast<size_t>(near))))
            found_.push_back(near);
        }
    }
  }
  std::sort(found_.begin(), found_.end());
  found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
  return found_;
}

}  // namespace qdmd
