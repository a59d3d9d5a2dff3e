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

}  // namespace

StandingLooks::StandingLooks(const Grid& grid)
    : grid_(grid),
      looks_(grid, 2),
      age_(grid.cells()),
      next_age_(grid.cells()),
      differs_(grid.cells()) {
  uncovered_.reserve(grid.cells());
}

uint64_t StandingLooks::bytes(const Grid& grid) {
  return GridFrames::bytes(grid, 2) +
         grid.cells() * (2 * sizeof(uint16_t) + sizeof(uint8_t) + sizeof(int));
}

void StandingLooks::forget() {
  std::fill(age_.begin(), age_.end(), uint16_t{0});
  std::fill(next_age_.begin(), next_age_.end(), uint16_t{0});
}

void StandingLooks::follow(const float* const frame[3], const Gain& gain) {
  const Gain inverse = {1 / gain[0], 1 / gain[1], 1 / gain[2]};
  float* const look[3] = {looks_.plane(0, 0), looks_.plane(0, 1), looks_.plane(0, 2)};
  float* const next[3] = {looks_.plane(1, 0), looks_.plane(1, 1), looks_.plane(1, 2)};
  for (size_t cell = 0; cell < grid_.cells(); ++cell) {
    float level[3], from_look = 0, from_next = 0;
    for (size_t c = 0; c < kChannels; ++c) {
      level[c] = frame[c][cell] * inverse[c];
      from_look += std::abs(level[c] - look[c][cell]);
      from_next += std::abs(level[c] - next[c][cell]);
    }
    const bool known = age_[cell] > 0;
    if (known && from_look < kSame) {
      const float share = std::max(kShare, 1 / static_cast<float>(age_[cell] + 1));
      for (size_t c = 0; c < kChannels; ++c) look[c][cell] += share * (level[c] - look[c][cell]);
      age_[cell] = static_cast<uint16_t>(std::min(age_[cell] + 1, 65535));
      next_age_[cell] = 0;
      continue;
    }
    const bool goes_on = next_age_[cell] > 0 && from_next < kSame;
    next_age_[cell] = static_cast<uint16_t>(goes_on ? next_age_[cell] + 1 : 1);
    const float share = 1 / static_cast<float>(next_age_[cell]);
    for (size_t c = 0; c < kChannels; ++c) next[c][cell] += share * (level[c] - next[c][cell]);
    if (next_age_[cell] < kSteady) continue;
    for (size_t c = 0; c < kChannels; ++c) look[c][cell] = next[c][cell];
    age_[cell] = std::exchange(next_age_[cell], uint16_t{0});
  }
}

const std::vector<int>& StandingLooks::uncovered(const float* const background[3]) {
  uncovered_.clear();
  if (std::min(grid_.rows, grid_.cols) < 4) return uncovered_;
  const float* const look[3] = {looks_.plane(0, 0), looks_.plane(0, 1), looks_.plane(0, 2)};
  size_t count = 0;
  for (size_t cell = 0; cell < grid_.cells(); ++cell) {
    differs_[cell] =
        age_[cell] >= kSteady && next_age_[cell] == 0 && differs_at(look, background, cell);
    count += differs_[cell];
  }
  if (count < kLeastRegion) return uncovered_;
  CellRegions regions(grid_);
  const auto& found = regions.find(differs_);
  for (size_t region = 0; region < found.size(); ++region)
    if (found[region].size() >= kLeastRegion &&
        Contour(grid_, regions, static_cast<int>(region), found[region])
            .is_weaker(look, background))
      uncovered_.insert(uncovered_.end(), found[region].begin(), found[region].end());
  return uncovered_;
}

}  // namespace qdmd
