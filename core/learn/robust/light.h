// Global changes of light: how much brighter a frame is than another picture of the same scene.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/learn/robust/learning_steps.h"
#include "core/parallel/pool.h"
#include "core/passes/grid.h"

namespace qdmd {

// The light of a window's frames.
struct WindowLight {
  std::vector<Gain> gains;
  // Samples are at the end of their range in some of the frames, and the light changes: unit light
  // is that of the darker frames, in which fewer are.
  bool clips = false;
};

// The gains of frames 0 .. count - 1 over their common background: 1 where a change of light does
// not explain what the frame and the background differ in, so that what moves counts as no light.
// Small changes around the light of most frames are left out: they are noise. median: becomes each
// cell's median over the frames (64 of them at most) in unit light, as frame 0; or null. pool: null
// for one thread.
WindowLight light_of(const GridPictures& frames, int count, Pool* pool = nullptr,
                     GridFrames* median = nullptr);
// The bytes that it takes.
uint64_t light_of_bytes(const Grid& grid, int threads);

// Memory for comparing two pictures of so many cells, which can serve many calls.
class LightScratch {
 public:
  LightScratch() = default;
  explicit LightScratch(size_t cells) {
    ratios.reserve(kChannels * cells);
    near.reserve(kChannels * cells);
  }
  static uint64_t bytes(uint64_t cells) {
    return kChannels * cells * (sizeof(std::pair<float, size_t>) + sizeof(float));
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

// True where a frame is brighter than unit light, and samples are at the end of their range.
bool at_end(const GridFrames& frames, int frame, const Gain& gain);

// How many of so many frames are the darkest ones, which say what is behind samples at the end of
// their range.
inline size_t most_darkest(size_t frames) {
  return std::min(frames, std::max(steps::light::kLeastDark, frames / steps::light::kDarkOf));
}

// What a cell shows in a frame with this gain, where `background` is what is behind it in unit
// light: `level`, or, where samples at the end of their range say no more than that it is brighter
// (darker) than they are, the background in that light.
inline float unclipped(float level, float background, float gain) {
  using namespace steps::light;
  const float expected = background * gain;
  if (level >= kNearEnd && expected > level) return expected;
  return background >= kAtEnd && gain < 1 && level > expected ? expected : level;
}

// Sets changes within 3 % of the light of most frames to 1, with a soft edge; all gains become
// relative to that light. Does nothing where no light is that of half of the frames.
void settle_light(std::vector<Gain>* gains);

}  // namespace qdmd
