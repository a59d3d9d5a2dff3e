// Global changes of light: how much brighter a frame is than another picture of the same scene.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/passes/grid.h"

namespace qdmd {

// The gains of frames 0 .. count - 1 over their common background: 1 where a change of light does
// not explain what the frame and the background differ in, so that what moves counts as no light.
// Small changes around the light of most frames are left out: they are noise.
std::vector<Gain> light_of(const GridFrames& frames, int count);

// Each cell's median over frames 0 .. count - 1 (64 of them at most) in unit light, as frame 0.
GridFrames median_frame(const GridFrames& frames, int count, const std::vector<Gain>& gains);

// Memory for comparing two pictures of so many cells, which can serve many calls.
class LightScratch {
 public:
  LightScratch() = default;
  explicit LightScratch(size_t cells) {
    ratios.reserve(cells);
    near.reserve(cells);
  }
  static uint64_t bytes(uint64_t cells) {
    return cells * (sizeof(std::pair<float, size_t>) + sizeof(float));
  }

  std::vector<std::pair<float, size_t>> ratios;
  std::vector<float> near;
};

// The gain of one frame over picture `reference` of `background`, both on the same grid; 1 where it
// does not explain what they differ in, or is small.
Gain light_over(const GridFrames& frames, int frame, const GridFrames& background, int reference,
                LightScratch* scratch);

// The gain of one frame over picture `reference` of `background`, where the frames before and after
// it have the gains `before` and `after`: between them, or, where the light changed by more than a
// little, one of them.
Gain light_between(const GridFrames& frames, int frame, const GridFrames& background, int reference,
                   const Gain& before, const Gain& after);

// Sets changes within 3 % of the light of most frames to 1, with a soft edge; all gains become
// relative to that light. Does nothing where no light is that of half of the frames.
void settle_light(std::vector<Gain>* gains);

}  // namespace qdmd
