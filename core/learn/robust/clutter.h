// SPDX-License-Identifier: LGPL-2.1-or-later
// What moves in front of most of the picture has colours of its own.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/learn/robust/learning_steps.h"
#include "core/parallel/pool.h"
#include "core/passes/grid.h"

namespace qdmd {

// Leaves near the camera may rest in front of a place for so long that most frames show them there.
// But elsewhere they move, and the background is known: a look with the colours of what moves is
// unlikely to be background. Colours are those of cells, 8 steps a channel, whatever the channels
// are.
class ClutterColours {
 public:
  // frames: looks of the cells, of which the first `count` are frames'; they stay where they
  // are.
  ClutterColours(const Grid& grid, const GridPictures& frames, int count, Pool* pool);
  static uint64_t bytes(const Grid& grid, uint64_t looks, int threads);

  // True where much of what frames show is unlike the background, and moves: few frames share it.
  // Many frames share another scene. from: of each cell the frame whose look is taken for the
  // background; density: of looks, PatchFrames::density().
  bool hides_much(std::span<const float> density, const std::vector<int>& from) const;
  // The colours of the background, and of what is unlike it.
  void learn(const std::vector<int>& from);
  // The densities times how much likelier the colours of the 5 x 5 cells around are in the
  // background than in what moves: the geometric mean. Until the next weigh().
  std::span<const float> weigh(std::span<const float> density);

 private:
  static constexpr int kSteps = steps::clutter::kSteps, kColours = kSteps * kSteps * kSteps;
  static int colour_of(const float* const look[3], size_t cell);
  // Finds a look's logarithms, by cells, in two rooms of as many numbers.
  void find_logarithms(int look, float* room, float* out) const;

  Grid grid_;
  const GridPictures& frames_;
  int count_;
  Pool* pool_;
  std::array<float, kColours> likelier_;  // logarithms
  std::vector<float> weighed_, rooms_;    // rooms: for each thread
};

}  // namespace qdmd
