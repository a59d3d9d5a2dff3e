// SPDX-License-Identifier: LGPL-2.1-or-later
// Global changes of light: how much brighter a frame is than another picture of the same scene.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
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

// The light of frames, one after another, over one background.
class LightOfFrames {
 public:
  LightOfFrames() = default;
  explicit LightOfFrames(size_t cells) : scratch_(cells) {}
  static uint64_t bytes(uint64_t cells) { return LightScratch::bytes(cells); }

  // Another background.
  void forget() { agreed_ = kUnknown; }
  // As light_over(), whose result it is for the first frame. A frame that agrees with the
  // background as well as those before it did, for which no other light was found, is in their
  // light.
  Gain over(const GridFrames& frames, int frame, const GridFrames& background, int reference);

 private:
  static constexpr float kUnknown = 2;  // no share is as large

  LightScratch scratch_;
  float agreed_ = kUnknown;  // the most that has agreed in the same light; kUnknown: in no frame
};

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

// True where a channel that shows `level` says no more than that it is brighter (darker) than that,
// and than `expected`, what `background` would show in a frame with this gain.
inline bool is_bound(float level, float expected, float background, float gain) {
  using namespace steps::light;
  return (level >= kNearEnd && expected > level) ||
         (background >= kAtEnd && gain < 1 && level > expected);
}

// True where a cell that shows `level` in a frame with this gain may show `background`, which is in
// unit light: samples at the end of their range are bounds.
inline bool may_show(const std::array<float, kChannels>& level,
                     const std::array<float, kChannels>& background, const Gain& gain) {
  for (size_t c = 0; c < kChannels; ++c) {
    const float expected = background[c] * gain[c];
    if (is_bound(level[c], expected, background[c], gain[c])) continue;
    if (std::abs(level[c] - expected) > steps::light::kOther * std::max(1.0f, gain[c]))
      return false;
  }
  return true;
}

// `level`; where it may show `background`, and samples hide that, the background in that light.
inline std::array<float, kChannels> unclipped(const std::array<float, kChannels>& level,
                                              const std::array<float, kChannels>& background,
                                              const Gain& gain) {
  if (!may_show(level, background, gain)) return level;
  std::array<float, kChannels> found = level;
  for (size_t c = 0; c < kChannels; ++c) {
    const float expected = background[c] * gain[c];
    if (is_bound(level[c], expected, background[c], gain[c])) found[c] = expected;
  }
  return found;
}

// The light without a small change of its colours, with a soft edge.
Gain without_tint(const Gain& gain);

// Sets changes within 3 % of the light of most frames to 1, with a soft edge; all gains become
// relative to that light. Does nothing where no light is that of half of the frames.
void settle_light(std::vector<Gain>* gains);

}  // namespace qdmd
