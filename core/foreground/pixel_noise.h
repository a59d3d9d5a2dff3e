// SPDX-License-Identifier: LGPL-2.1-or-later
// How far each pixel is from the background while it is background.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/large_vector.h"
#include "core/foreground/decision_steps.h"
#include "core/passes/mean_distance.h"

namespace qdmd {

// A mean distance of each pixel, in 1/256 level, which follows the newest frames. A pixel that is
// foreground for a moment, and was not in the frame before, counts as well. Lamps and blocks of
// compressed video that come and go raise the mean until they are background; people come too
// seldom for that.
class PixelNoise {
 public:
  // Takes all memory.
  PixelNoise(int width, int height, const DecisionConstants& constants = {});
  static uint64_t bytes(int width, int height);

  // Begins afresh.
  void forget();
  // The noise of a row of pixels.
  uint16_t* row(int y) { return mean_.data() + static_cast<size_t>(y) * width_; }
  // One row in a few of a frame says enough, other rows of each frame. Streams of one recording
  // agree best if they begin so many frames apart (kTurn of qdmd-archive).
  bool learns_from(int y) const { return (y + frames_) % kRows == 0; }
  // Learns from pixels left .. left + count - 1 of such a row. squared: squared distances; limit:
  // the pixels' own limits in levels; near: 0 for background that is not next to foreground; now:
  // the mask. Each row is one thread's.
  void learn(int y, size_t left, size_t count, const uint16_t* squared, const uint8_t* limit,
             const uint8_t* near, const uint8_t* now);
  // After the last row of a frame, with its mask, width * height samples.
  void end_frame(const uint8_t* mask);

 private:
  static constexpr int kRows = 8;

  size_t width_;
  int height_;
  double most_samples_, weight_of_moments_;
  NoiseRates rates_;
  int64_t frames_ = 0;
  LargeVector<uint16_t> mean_;
  std::vector<uint8_t> before_;  // the rows that are learnt from, of the frame before
};

}  // namespace qdmd
