// SPDX-License-Identifier: LGPL-2.1-or-later
// From which frame on cells show their background: frames from before say nothing there.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/learn/robust/places.h"
#include "core/learn/robust/stable_frames.h"

namespace qdmd {

class HistoryStarts {
 public:
  static constexpr int64_t kNever = INT64_MIN;

  HistoryStarts() = default;
  // Takes all memory.
  explicit HistoryStarts(size_t cells) : since_(cells, kNever), fresh_(cells) {}
  static uint64_t bytes(uint64_t cells) { return cells * (sizeof(int64_t) + sizeof(uint8_t)); }

  void forget() {
    any_ = false;
    std::fill(since_.begin(), since_.end(), kNever);
    std::fill(fresh_.begin(), fresh_.end(), uint8_t{0});
  }
  // What the cell shows has been there since that frame, and is its background.
  void add(int cell, int64_t since) {
    any_ = true;
    since_[static_cast<size_t>(cell)] = since;
    fresh_[static_cast<size_t>(cell)] = 1;
  }
  // Makes `solve` what the next solve knows. What was added since the one before is no news then.
  void hand_over(HistoryStarts* solve) {
    if (!any_ && !solve->any_) return;
    *solve = *this;
    std::fill(fresh_.begin(), fresh_.end(), uint8_t{0});
  }

  // What is known of a cell, for a file and back, as it was with frame `now`.
  void write(size_t cell, int64_t now, LearntPlace* out) const {
    if (since_[cell] == kNever) return;
    out->absorbed_since = frames_ago(since_[cell], now);
    out->is_absorbed_news = fresh_[cell];
  }
  void read(size_t cell, int64_t now, const LearntPlace& from) {
    const bool is_absorbed = from.absorbed_since != LearntPlace::kNever;
    any_ |= is_absorbed;
    since_[cell] = is_absorbed ? now - from.absorbed_since : kNever;
    fresh_[cell] = is_absorbed ? from.is_absorbed_news : 0;
  }

  // True where no solve was told of it.
  bool is_news(int cell) const { return fresh_[static_cast<size_t>(cell)] != 0; }
  bool any() const { return any_; }
  bool has(int cell) const { return since(cell) != kNever; }
  // kNever: all frames say something.
  int64_t since(int cell) const { return since_[static_cast<size_t>(cell)]; }
  // Leaves out the looks from before, of those with these numbers, in order; and what earlier
  // windows showed, where they ended before it was added. looks: of all cells.
  void leave_out(const std::vector<int64_t>& numbers, FirstLooks* looks) const {
    for (size_t cell = 0; cell < since_.size(); ++cell) {
      const auto first = std::lower_bound(numbers.begin(), numbers.end(), since_[cell]);
      const auto from = static_cast<uint16_t>(
          std::min<ptrdiff_t>(first - numbers.begin(), std::ssize(numbers) - 1));
      looks->from[cell] = std::max(looks->from[cell], from);
      if (fresh_[cell]) looks->earlier_counts[cell] = 0;
    }
  }

 private:
  std::vector<int64_t> since_;
  std::vector<uint8_t> fresh_;  // added since the newest solve
  bool any_ = false;
};

}  // namespace qdmd
