// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/specks.h"

#include <cstring>

#include "core/foreground/mask_runs.h"
#include "core/foreground/parts.h"

namespace qdmd {
namespace {

size_t most_runs(int width, int height) {
  return static_cast<size_t>(width) * static_cast<size_t>(height) / 16 + 1;
}

}  // namespace

Specks::Specks(int width, int height)
    : width_(static_cast<size_t>(width)),
      height_(static_cast<size_t>(height)),
      most_runs_(most_runs(width, height)),
      rows_(height_ + 1) {
  runs_.reserve(most_runs_);
}

uint64_t Specks::bytes(int width, int height) {
  return most_runs(width, height) * sizeof(Run) +
         (static_cast<uint64_t>(height) + 1) * sizeof(uint32_t);
}

bool Specks::take_out(uint8_t* mask, uint8_t colour, size_t least, bool diagonal) {
  const auto other = static_cast<uint8_t>(~colour);
  const int width = static_cast<int>(width_), corner = diagonal ? 1 : 0;
  const auto find_part = [this](uint32_t run) {
    return part_of(run, [this](uint32_t i) -> uint32_t& { return runs_[i].part; });
  };
  runs_.clear();
  for (size_t y = 0; y < height_; ++y) {
    rows_[y] = static_cast<uint32_t>(runs_.size());
    const uint8_t* const row = mask + y * width_;
    uint32_t above = y > 0 ? rows_[y - 1] : rows_[y];
    for (int at = next_of(row, 0, width, colour); at < width;) {
      const int end = next_of(row, at, width, other);
      if (runs_.size() == most_runs_) return false;
      const auto run = static_cast<uint32_t>(runs_.size());
      runs_.push_back({at, end, run, static_cast<uint32_t>(end - at)});
      // Runs of the row above that it touches. The last of them may touch the next one, too.
      while (above < rows_[y] && runs_[above].end + corner <= at) ++above;
      for (uint32_t i = above; i < rows_[y] && runs_[i].begin < end + corner; ++i) {
        const uint32_t a = find_part(i), b = find_part(run);
        if (a == b) continue;
        runs_[a].area += runs_[b].area;
        runs_[b].part = a;
      }
      at = end < width ? next_of(row, end, width, colour) : width;
    }
  }
  rows_[height_] = static_cast<uint32_t>(runs_.size());
  for (size_t y = 0; y < height_; ++y)
    for (uint32_t i = rows_[y]; i < rows_[y + 1]; ++i)
      if (runs_[find_part(i)].area < least)
        std::memset(mask + y * width_ + runs_[i].begin, other,
                    static_cast<size_t>(runs_[i].end - runs_[i].begin));
  return true;
}

}  // namespace qdmd
