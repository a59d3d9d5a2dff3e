// SPDX-License-Identifier: LGPL-2.1-or-later
// Moments in which something disturbs the picture as a whole: no signal, a smear, fog.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/learn/robust/learning_steps.h"

namespace qdmd {

// Objects come in steps: few change a tenth of the picture from one frame to the next. Frames from
// such a change on say nothing of the background: until they show it again, or until the change has
// lasted for so long that it is the scene.
class Disturbances {
 public:
  void forget() { *this = {}; }
  // share: the cells of frame `number`, of all, that do not show the background in the frame's
  // light. Frames come in order.
  void follow(double share, int64_t number) {
    using namespace steps::disturbance;
    const double more = share - usual_, at_once = share - before_;
    before_ = share;
    if (goes_on()) {
      if (more < kOver)
        end(number);
      else if (number - begins_ >= steps::proofs::kLasts)
        forget();
    } else if (followed_ >= kKnown && more > kLeast && at_once > kAtOnce) {
      begins_ = number;
    } else {
      usual_ = std::max(share, usual_ + kFalls * more);
      ++followed_;
    }
  }
  // The newest frame is disturbed.
  bool goes_on() const { return begins_ != kNever; }
  // Frames that were not followed yet are taken for disturbed, too, as long as it goes on.
  bool has(int64_t number) const {
    if (number >= begins_) return true;
    for (const Moment& moment : moments_)
      if (number >= moment.first && number < moment.end) return true;
    return false;
  }

 private:
  static constexpr int64_t kNever = INT64_MAX;
  static constexpr size_t kMost = 16;
  struct Moment {
    int64_t first = 0, end = 0;
  };

  void end(int64_t number) {
    moments_[next_] = {begins_, number};
    next_ = (next_ + 1) % kMost;
    begins_ = kNever;
  }

  std::array<Moment, kMost> moments_ = {};  // the newest ones that are over
  size_t next_ = 0;
  int64_t begins_ = kNever;        // of what goes on
  double usual_ = 0, before_ = 0;  // the most that undisturbed frames have shown lately; the newest
  int followed_ = 0;               // frames that nothing disturbed
};

}  // namespace qdmd
