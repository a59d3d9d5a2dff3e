// SPDX-License-Identifier: LGPL-2.1-or-later
// How often each cell has shown its background, and other looks: enough frames make it known.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/learn/robust/in_blocks.h"
#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/standing_looks.h"

namespace qdmd {

class ShownCounts {
 public:
  ShownCounts() = default;
  // Takes all memory.
  explicit ShownCounts(size_t cells) : shown_(cells), others_(cells), shows_other_(cells) {
    for (std::vector<float>& levels : background_) levels.resize(cells);
  }
  static uint64_t bytes(uint64_t cells) {
    return cells * (2 * sizeof(int) + sizeof(uint8_t) + kChannels * sizeof(float));
  }

  void forget() {
    std::fill(shown_.begin(), shown_.end(), 0);
    std::fill(others_.begin(), others_.end(), 0);
    std::fill(shows_other_.begin(), shows_other_.end(), uint8_t{0});
    counts_ = grown_up_ = false;
  }
  // Somebody else has seen enough frames: the next background is known in all cells.
  void grow_up() { grown_up_ = true; }
  // Counts the newest frame of `looks`. differs: by cells, as StandingLooks::find_differing.
  // Another background, which a look came to show or no longer shows, begins with the frames of
  // that look. Else it is the same one in another light.
  void count(const StandingLooks& looks, const std::vector<uint8_t>& differs,
             const float* const background[3]) {
    in_blocks(shown_.size(), [&](size_t first, size_t size) {
      float moved[kTogether] = {};
      for (size_t c = 0; c < kChannels; ++c) {
        const float* const now = background[c] + first;
        float* const before = background_[c].data() + first;
        for (size_t i = 0; i < size; ++i) moved[i] += std::abs(now[i] - before[i]);
        std::copy_n(now, size, before);
      }
      for (size_t i = 0; i < size; ++i) count(looks, differs, first + i, moved[i]);
    });
    counts_ = true;
    grown_up_ = false;
  }
  // True where the newest look that the cell showed is not the background's: also while somebody
  // moves there, and it shows none.
  bool shows_other(size_t cell) const { return shows_other_[cell] != 0; }
  // Lorries may have hidden most of a street for the whole of a window: nothing is known of a place
  // until many frames have shown its background, or three seconds of frames which are most of those
  // before the look that is there now. now: for how many frames that look has been there.
  bool is_known(size_t cell, int64_t now) const {
    return shown_[cell] >= steps::proofs::kYoungFrames ||
           (shown_[cell] >= steps::proofs::kLasts && shown_[cell] >= 2 * (others_[cell] - now));
  }

 private:
  // moved: how far the cell's background is from the one before, sum of the channels.
  void count(const StandingLooks& looks, const std::vector<uint8_t>& differs, size_t cell,
             float moved) {
    const int at = static_cast<int>(cell);
    const bool shows_look = looks.shows_look(at), shows = !differs[cell] && shows_look;
    const bool same = !shows_look || differs[cell] == shows_other_[cell];
    if (grown_up_) {
      shown_[cell] = static_cast<int>(steps::proofs::kYoungFrames);
    } else if (!counts_ || (moved >= StandingLooks::kSame && !same)) {
      shown_[cell] = shows ? looks.frames(at) : 0;
      others_[cell] = 0;
    } else {
      shown_[cell] += shows;
      others_[cell] += differs[cell];
      // Who comes later and stands for long does not make it less known.
      if (shows && shown_[cell] >= steps::proofs::kLasts && shown_[cell] >= 2 * others_[cell])
        shown_[cell] = std::max(shown_[cell], static_cast<int>(steps::proofs::kYoungFrames));
    }
    if (shows_look) shows_other_[cell] = differs[cell];
  }

  std::array<std::vector<float>, kChannels> background_;
  std::vector<int> shown_, others_;
  std::vector<uint8_t> shows_other_;  // the newest look that it showed is not the background's
  bool counts_ = false;               // a background is known
  bool grown_up_ = false;
};

}  // namespace qdmd
