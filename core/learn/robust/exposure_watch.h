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
    means_[static_cast<size_t>(frames_ % kFrames)] = mean_of_darker(frame, cells);
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
  // The mean of the darker half of the cells: samples at the end of their range hide how the light
  // of the others changes.
  static double mean_of_darker(const float* const frame[kChannels], size_t cells) {
    struct Bin {
      size_t count = 0;
      double sum = 0;
    };
    std::array<Bin, 256> bins;
    for (size_t cell = 0; cell < cells; ++cell) {
      const float level = (frame[0][cell] + frame[1][cell] + frame[2][cell]) / kChannels;
      Bin& bin = bins[static_cast<size_t>(std::clamp(level, 0.0f, 255.0f))];
      ++bin.count;
      bin.sum += static_cast<double>(level);
    }
    const auto half = std::max<size_t>(1, cells / 2);
    double sum = 0;
    size_t left = half;
    for (const Bin& bin : bins) {
      if (bin.count == 0) continue;
      const size_t taken = std::min(left, bin.count);
      sum += bin.sum * static_cast<double>(taken) / static_cast<double>(bin.count);
      left -= taken;
    }
    return sum / static_cast<double>(half);
  }

  static constexpr int kFrames = steps::exposure::kFrames;
  static QDMD_STEP int kLongest = steps::exposure::kLongest;
  static QDMD_STEP double kDark = steps::exposure::kDark, kRests = steps::exposure::kRests;

  std::array<double, kFrames> means_ = {};
  int frames_ = 0;
  bool settled_ = false, waited_ = false, found_ = false;
};

}  // namespace qdmd
