// SPDX-License-Identifier: LGPL-2.1-or-later
// What was said of the look of each cell: it came, or it was behind what has left.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/learn/robust/standing_looks.h"

namespace qdmd {

// A judgement is about the look that came with a certain frame, and goes where another look comes.
class Judgements {
 public:
  enum class Of : uint8_t { none, came, left };
  static constexpr int64_t kNever = StandingLooks::kNever;

  Judgements() = default;
  // Takes all memory.
  explicit Judgements(size_t cells) : of_(cells), since_(cells), left_(cells, kNever) {}
  static uint64_t bytes(uint64_t cells) { return cells * (sizeof(Of) + 2 * sizeof(int64_t)); }

  void forget() {
    std::fill(of_.begin(), of_.end(), Of::none);
    std::fill(left_.begin(), left_.end(), kNever);
    newest_left_ = kNever;
  }
  // Says it of the look that came with frame `since`.
  void decide(int cell, Of of, int64_t since) {
    of_[static_cast<size_t>(cell)] = of;
    since_[static_cast<size_t>(cell)] = since;
  }
  // Something was found to have left there in frame `now`.
  void note_left(int cell, int64_t now) { newest_left_ = left_[static_cast<size_t>(cell)] = now; }
  // What was said of the look that came with frame `since`.
  Of of(int cell, int64_t since) const {
    const auto at = static_cast<size_t>(cell);
    return since_[at] >= since ? of_[at] : Of::none;
  }
  // The same; what was said of an earlier look is forgotten.
  Of renewed(int cell, int64_t since) { return of_[static_cast<size_t>(cell)] = of(cell, since); }
  // With which frame the look came that was judged last.
  int64_t since(int cell) const { return since_[static_cast<size_t>(cell)]; }
  // The frame in which something was last found to have left: there, and anywhere; kNever: none.
  int64_t left(int cell) const { return left_[static_cast<size_t>(cell)]; }
  int64_t newest_left() const { return newest_left_; }

  // What was said of a cell's look, for a file and back, as it was with frame `now`. is_news: no
  // solve was told that something has left; look_since: when the look came.
  void write(int cell, int64_t now, int64_t look_since, bool is_news, LearntPlace* out) const {
    const Of said = of(cell, look_since);
    // What solves know of what left is in the earlier window.
    const bool is_known = said == Of::came || (said == Of::left && is_news);
    if (out->since != LearntPlace::kNever && is_known) {
      out->judgement = said == Of::came ? LearntPlace::kCame : LearntPlace::kLeft;
      out->judged_since = frames_ago(since(cell), now);
    }
    if (left(cell) != kNever) out->left = frames_ago(left(cell), now);
  }
  void read(int cell, int64_t now, const LearntPlace& from) {
    constexpr Of kSaid[] = {Of::none, Of::came, Of::left};
    static_assert(LearntPlace::kCame == 1 && LearntPlace::kLeft == 2);
    decide(cell, kSaid[from.judgement], now - from.judged_since);
    left_[static_cast<size_t>(cell)] =
        from.left == LearntPlace::kNever ? kNever : now - int64_t{from.left};
    newest_left_ = std::max(newest_left_, left(cell));
  }

 private:
  std::vector<Of> of_;
  std::vector<int64_t> since_, left_;
  int64_t newest_left_ = kNever;
};

}  // namespace qdmd
