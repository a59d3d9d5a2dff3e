// SPDX-License-Identifier: LGPL-2.1-or-later
// Notices when a camera that starts has found its exposure.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "core/learn/robust/learning_steps.h"
#include "core/passes/grid.h"

namespace qdmd {

class ExposureWatch {
 public:
  void forget() { *this = {}; }
  // The next frame's cells. Once settled, it stays so. True where it has found its rest after some
  // time without.
  bool follow(const float* const frame[kChannels], size_t cells) {
    if (settled_) return false;
    double sum = 0;
    for (int c = 0; c < kChannels; ++c)
      for (size_t cell = 0; cell < cells; ++cell) sum += static_cast<double>(frame[c][cell]);
    const double mean = sum / static_cast<double>(kChannels * std::max<size_t>(1, cells));
    means_[static_cast<size_t>(frames_ % kFrames)] = mean;
    if (++frames_ < kFrames) return false;
    const auto [least, most] = std::minmax_element(means_.begin(), means_.end());
    const bool rests = *least > kDark && *most < (1 + kRests) * *least;
    settled_ = rests || frames_ >= kLongest;
    found_ = rests && waited_;
    waited_ |= !rests;
    return found_;
  }
  // The light rests, or nobody can wait any longer.
  bool settled() const { return settled_; }
  // True once, after follow() was.
  bool has_found() { return std::exchange(found_, false); }

 private:
  static constexpr int kFrames = steps::exposure::kFrames;
  static QDMD_STEP int kLongest = steps::exposure::kLongest;
  static QDMD_STEP double kDark = steps::exposure::kDark, kRests = steps::exposure::kRests;

  std::array<double, kFrames> means_ = {};
  int frames_ = 0;
  bool settled_ = false, waited_ = false, found_ = false;
};

}  // namespace qdmd
