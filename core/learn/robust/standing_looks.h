// What each cell of the picture shows, and since when: passers-by aside.
#pragma once

#include <cstdint>
#include <vector>

#include "core/learn/robust/contour.h"
#include "core/passes/grid.h"

namespace qdmd {

// A cell's look is what it showed last for kSteady frames in a row.
class StandingLooks {
 public:
  static constexpr int kSteady = 10;

  StandingLooks() = default;
  // Takes all memory.
  explicit StandingLooks(const Grid& grid);
  static uint64_t bytes(const Grid& grid);

  // Nothing is known.
  void forget();
  // The next frame of the stream, its levels divided by `gain`.
  void follow(const float* const frame[3], const Gain& gain);
  // Of a cell whose look is known.
  float level(int cell, int channel) const { return looks_.plane(0, channel)[cell]; }
  // What was uncovered: cells whose look has lasted for kSteady frames and is not the background's,
  // in regions where the background has the stronger contour. Good until the next call.
  const std::vector<int>& uncovered(const float* const background[3]);

 private:
  Grid grid_;
  GridFrames looks_;                      // the look, and what may become the next
  std::vector<uint16_t> age_, next_age_;  // frames in which the cell showed them
  std::vector<uint8_t> differs_;
  std::vector<int> uncovered_;
};

}  // namespace qdmd
