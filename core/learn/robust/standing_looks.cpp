// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/standing_looks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/learn/robust/in_blocks.h"
#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/near_cells.h"
#include "core/learn/robust/places.h"

namespace qdmd {
namespace {

using namespace steps::looks;
constexpr int kLook = 0, kNext = 1, kBefore = 2;
constexpr int kPassedInFiles = 128;  // frames

// The planes of cell `first` and of those after it.
struct Planes {
  const float *red, *green, *blue;
  Planes(const float* const of[3], size_t first)
      : red(of[0] + first), green(of[1] + first), blue(of[2] + first) {}
};

// How far cells of two pictures are apart, sum of the channels; returns how many are not nearer
// than `same`.
inline int compare(const Planes& a, const Planes& b, size_t count, float* __restrict apart,
                   float same = kSame) {
  for (size_t i = 0; i < count; ++i)
    apart[i] = std::abs(a.red[i] - b.red[i]) + std::abs(a.green[i] - b.green[i]) +
               std::abs(a.blue[i] - b.blue[i]);
  int others = 0;
  for (size_t i = 0; i < count; ++i) others += apart[i] < same ? 0 : 1;
  return others;
}

}  // namespace

StandingLooks::StandingLooks(const Grid& grid)
    : grid_(grid),
      looks_(grid, 3),
      cells_(grid.cells()),
      frames_(grid.cells()),
      next_frames_(grid.cells()),
      differs_(grid.cells()) {
  passed_.resize(kHistory * words());
  found_.reserve(grid.cells());
}

uint64_t StandingLooks::bytes(const Grid& grid) {
  return GridFrames::bytes(grid, 3) +
         grid.cells() * (sizeof(Cell) + sizeof(uint8_t) + 3 * sizeof(int)) +
         kHistory * ((grid.cells() + 63) / 64) * sizeof(uint64_t);
}

void StandingLooks::forget() {
  std::fill(cells_.begin(), cells_.end(), Cell());
  std::fill(frames_.begin(), frames_.end(), 0);
  std::fill(next_frames_.begin(), next_frames_.end(), 0);
  std::fill(passed_.begin(), passed_.end(), uint64_t{0});
}

void StandingLooks::write(size_t at, int64_t now, LearntPlace* out) const {
  if (frames_[at] == 0) return;
  const Cell& cell = cells_[at];
  out->since = frames_ago(cell.look.since, now);
  for (int c = 0; c < kChannels; ++c) out->look[c] = looks_.plane(kLook, c)[at];
  for (int ago = 0; ago < kPassedInFiles; ++ago)
    if (passed(static_cast<int>(at), now - ago)) out->passed[ago / 64] |= uint64_t{1} << (ago % 64);
  if (!cell.had_before) return;
  out->before_since = frames_ago(cell.before.since, now);
  out->before_until = frames_ago(cell.before.last, now);
  for (int c = 0; c < kChannels; ++c) out->before[c] = looks_.plane(kBefore, c)[at];
}

bool StandingLooks::read(size_t at, int64_t now, const LearntPlace& from) {
  if (frames_[at] > 0) {
    float apart = 0;
    for (int c = 0; c < kChannels; ++c)
      apart += std::abs(looks_.plane(kLook, c)[at] - from.look[c]);
    if (from.since == LearntPlace::kNever || apart >= kSame) return false;
  }
  // A look that frames have shown has who passed.
  for (int ago = 0; ago < kPassedInFiles && frames_[at] == 0; ++ago)
    passed_[row_of(now - ago) + at / 64] |= (from.passed[ago / 64] >> (ago % 64) & 1) << (at % 64);
  number_ = now;
  Cell& cell = cells_[at];
  cell = Cell();
  // More frames count no more.
  frames_[at] = from.since == LearntPlace::kNever ? 0 : kSteady;
  next_frames_[at] = 0;
  if (frames_[at] == 0) return true;
  cell.look = {now - from.since, now};
  cell.had_before = from.before_until != LearntPlace::kNever;
  if (cell.had_before) cell.before = {now - from.before_since, now - from.before_until};
  for (int c = 0; c < kChannels; ++c) {
    looks_.plane(kLook, c)[at] = from.look[c];
    looks_.plane(kBefore, c)[at] = from.before[c];
  }
  return true;
}

void StandingLooks::follow(const float* const frame[3], const Gain& gain, int64_t number) {
  previous_ = std::exchange(number_, number);
  std::fill_n(passed_.begin() + static_cast<ptrdiff_t>(row_of(number)), words(), uint64_t{0});
  const Gain inverse = {1 / gain[0], 1 / gain[1], 1 / gain[2]};
  const float* const looks[3] = {looks_.plane(kLook, 0), looks_.plane(kLook, 1),
                                 looks_.plane(kLook, 2)};
  in_blocks(cells_.size(), [&](size_t first, size_t count) {
    float level[kChannels][kTogether], apart[kTogether];
    for (size_t c = 0; c < kChannels; ++c) {
      const float* const now = frame[c] + first;
      for (size_t i = 0; i < count; ++i) level[c][i] = now[i] * inverse[c];
    }
    const float* const now[3] = {level[0], level[1], level[2]};
    compare({now, 0}, {looks, first}, count, apart);
    int* const frames = frames_.data() + first;
    int* const next_frames = next_frames_.data() + first;
    // Whether a cell shows its look, and what the frame counts in that: nothing where it does not.
    int shows[kTogether], others = 0;
    float share[kTogether];
    for (size_t i = 0; i < count; ++i) {
      shows[i] = static_cast<int>(frames[i] > 0) & static_cast<int>(apart[i] < kSame);
      others += 1 - shows[i];
      frames[i] += shows[i];
      next_frames[i] &= shows[i] - 1;
      const float part = 1 / static_cast<float>(frames[i] + 1 - shows[i]);
      share[i] = static_cast<float>(shows[i]) * (part > kShare ? part : kShare);
    }
    for (size_t c = 0; c < kChannels; ++c) {
      float* const look = looks_.plane(kLook, static_cast<int>(c)) + first;
      for (size_t i = 0; i < count; ++i) look[i] += share[i] * (level[c][i] - look[i]);
    }
    for (size_t i = 0; i < count && others > 0; ++i) {
      if (shows[i]) continue;
      see_other(first + i, {level[0][i], level[1][i], level[2][i]});
      --others;
    }
  });
}

// A cell that does not show its look, or has none.
void StandingLooks::see_other(size_t at, const std::array<float, kChannels>& level) {
  Cell& cell = cells_[at];
  int& frames = next_frames_[at];
  if (frames_[at] > 0 && frames == 0) cell.look.last = previous_;
  if (frames_[at] >= kSteady) passed_[row_of(number_) + at / 64] |= uint64_t{1} << (at % 64);
  float* const next[3] = {looks_.plane(kNext, 0) + at, looks_.plane(kNext, 1) + at,
                          looks_.plane(kNext, 2) + at};
  float away = 0;
  for (size_t c = 0; c < kChannels; ++c) away += std::abs(level[c] - *next[c]);
  if (frames == 0 || away >= kSame) {
    cell.next_since = number_;
    frames = 1;
    for (size_t c = 0; c < kChannels; ++c) *next[c] = level[c];
    return;
  }
  ++frames;
  const float share = 1 / static_cast<float>(frames);
  for (size_t c = 0; c < kChannels; ++c) *next[c] += share * (level[c] - *next[c]);
  if (frames == kSteady) take_next(at);
}

void StandingLooks::take_next(size_t at) {
  Cell& cell = cells_[at];
  float from_before = 0;
  for (int c = 0; c < kChannels; ++c)
    from_before += std::abs(looks_.plane(kNext, c)[at] - looks_.plane(kBefore, c)[at]);
  const Look before = std::exchange(cell.before, cell.look);
  cell.had_before = frames_[at] > 0;
  cell.look = {cell.next_since, number_};
  frames_[at] = std::exchange(next_frames_[at], 0);
  if (from_before < kSame && cell.look.since - before.last <= before.last - before.since)
    cell.look.since = before.since;
  for (int c = 0; c < kChannels; ++c) {
    looks_.plane(kBefore, c)[at] = looks_.plane(kLook, c)[at];
    looks_.plane(kLook, c)[at] = looks_.plane(kNext, c)[at];
  }
}

const std::vector<int>& StandingLooks::uncovered(const float* const background[3]) {
  found_.clear();
  news_ = 0;
  size_t differing = 0;
  if (std::min(grid_.rows, grid_.cols) < 4) return found_;
  const float* const look[3] = {looks_.plane(kLook, 0), looks_.plane(kLook, 1),
                                looks_.plane(kLook, 2)};
  for (size_t cell = 0; cell < grid_.cells(); ++cell) {
    differs_[cell] = differs_at(look, background, cell) && shows(cell);
    differing += differs_[cell];
    news_ += differs_[cell] && number_ - cells_[cell].look.since < kNewsFrames;
  }
  if (differing < kLeastRegion) return found_;
  CellRegions regions(grid_);
  const auto& found = regions.find(differs_);
  for (size_t region = 0; region < found.size(); ++region)
    if (found[region].size() >= kLeastRegion &&
        Contour(grid_, regions, static_cast<int>(region), found[region])
            .is_weaker(look, background))
      found_.insert(found_.end(), found[region].begin(), found[region].end());
  return found_;
}

void StandingLooks::leave_out_hidden(const GridFrames& frames, std::span<const LitSlot> slots,
                                     std::vector<int>* of) const {
  std::erase_if(*of, [&](int cell) {
    const auto hides = [&](const LitSlot& at) {
      float apart = 0;
      for (int c = 0; c < kChannels; ++c)
        apart += std::abs(frames.plane(at.slot, c)[cell] / at.light[static_cast<size_t>(c)] -
                          level(cell, c));
      return apart >= kSame;
    };
    const auto count = std::count_if(slots.begin(), slots.end(), hides);
    return count >= kHiding || 2 * count >= std::ssize(slots);
  });
}

void StandingLooks::find_differing(const float* const background[3], std::vector<uint8_t>* differs,
                                   std::vector<int>* differing) const {
  differing->clear();
  const float* const look[3] = {looks_.plane(kLook, 0), looks_.plane(kLook, 1),
                                looks_.plane(kLook, 2)};
  const float kDiffer = kChannels * kLooksDiffer;
  in_blocks(grid_.cells(), [&](size_t first, size_t count) {
    float apart[kTogether];
    uint8_t* const out = differs->data() + first;
    std::fill_n(out, count, uint8_t{0});
    if (compare({look, first}, {background, first}, count, apart, kDiffer) == 0) return;
    for (size_t i = 0; i < count; ++i) {
      out[i] = apart[i] > kDiffer && shows(first + i);
      if (out[i]) differing->push_back(static_cast<int>(first + i));
    }
  });
}

const std::vector<int>& StandingLooks::stood(const float* const background[3], int64_t frames) {
  found_.clear();
  const float* const look[3] = {looks_.plane(kLook, 0), looks_.plane(kLook, 1),
                                looks_.plane(kLook, 2)};
  const auto ripe = [&](size_t cell) { return number_ - cells_[cell].look.since >= frames; };
  bool any = false;
  in_blocks(grid_.cells(), [&](size_t first, size_t count) {
    float apart[kTogether];
    uint8_t* const differs = differs_.data() + first;
    std::fill_n(differs, count, uint8_t{0});
    // Few cells differ: what else is known of a cell is looked at there only.
    if (compare({look, first}, {background, first}, count, apart) == 0) return;
    for (size_t i = 0; i < count; ++i) {
      differs[i] = apart[i] >= kSame && shows(first + i);
      any |= differs[i] && ripe(first + i);
    }
  });
  if (!any) return found_;
  CellRegions regions(grid_);
  for (const std::vector<int>& region : regions.find(differs_)) {
    const auto ripe_cells = std::count_if(
        region.begin(), region.end(), [&](int cell) { return ripe(static_cast<size_t>(cell)); });
    if (2 * static_cast<size_t>(ripe_cells) < region.size()) continue;
    for (int cell : region)
      each_near(grid_, cell, 1, [&](int near) {
        const auto at = static_cast<size_t>(near);
        if (near == cell || (!differs_[at] && shows(at))) found_.push_back(near);
      });
  }
  std::sort(found_.begin(), found_.end());
  found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
  return found_;
}

}  // namespace qdmd
