// What stood for so long that it is background now: frames from before say nothing there.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/learn/robust/stable_frames.h"

namespace qdmd {

class Absorbed {
 public:
  Absorbed() = default;
  // Takes all memory.
  explicit Absorbed(size_t cells) : since_(cells, kNever), fresh_(cells) {}
  static uint64_t bytes(uint64_t cells) { return cells * (sizeof(int64_t) + sizeof(uint8_t)); }

  void forget() {
    any_ = false;
    std::fill(since_.begin(), since_.end(), kNever);
    std::fill(fresh_.begin(), fresh_.end(), uint8_t{0});
  }
  // What the cell shows has been there since that frame.
  void add(int cell, int64_t since) {
    any_ = true;
    since_[static_cast<size_t>(cell)] = since;
    fresh_[static_cast<size_t>(cell)] = 1;
  }
  // Makes `solve` what the next solve knows. What was added since the one before is no news then.
  void hand_over(Absorbed* solve) {
    if (!any_ && !solve->any_) return;
    *solve = *this;
    std::fill(fresh_.begin(), fresh_.end(), uint8_t{0});
  }

  bool any() const { return any_; }
  bool has(int cell) const { return since_[static_cast<size_t>(cell)] != kNever; }
  // Which looks count, of those with these numbers, in order. What earlier windows showed does not
  // count where they ended before it was absorbed.
  FirstLooks first_looks(const std::vector<int64_t>& numbers) const {
    FirstLooks result = {std::vector<uint16_t>(since_.size()), std::vector<uint8_t>(since_.size())};
    for (size_t cell = 0; cell < since_.size(); ++cell) {
      const auto first = std::lower_bound(numbers.begin(), numbers.end(), since_[cell]);
      result.from[cell] = static_cast<uint16_t>(
          std::min<ptrdiff_t>(first - numbers.begin(), std::ssize(numbers) - 1));
      result.earlier_counts[cell] = !fresh_[cell];
    }
    return result;
  }

 private:
  static constexpr int64_t kNever = INT64_MIN;

  std::vector<int64_t> since_;
  std::vector<uint8_t> fresh_;  // added since the newest solve
  bool any_ = false;
};

}  // namespace qdmd
