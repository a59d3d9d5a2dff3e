// SPDX-License-Identifier: LGPL-2.1-or-later
// Samples under another light: the one rounding that all passes share.
#pragma once

#include <cstdint>

#include "core/base/channels.h"

namespace qdmd {

// What the map makes of the sample, rounded to nearest. In loops that the compiler makes vectors
// of.
[[gnu::always_inline]] inline uint8_t in_light(uint8_t sample, const LevelMap& map) {
  const float level = static_cast<float>(sample) * map.factor + (0.5f + map.offset);
  const float below = level < map.most ? level : map.most;
  return static_cast<uint8_t>(static_cast<int>(below > map.least ? below : map.least));
}

// The sample of this light in unit light, rounded in the same way: for few samples, without the
// second rounding that a product with 1 / gain has.
inline uint8_t out_of_light(uint8_t sample, const SampleLight& light, size_t channel) {
  const LevelMap back = light.back(channel);
  const float level = static_cast<float>(sample) / light.gain[channel] + (0.5f + back.offset);
  const float below = level < back.most ? level : back.most;
  return static_cast<uint8_t>(static_cast<int>(below > back.least ? below : back.least));
}

}  // namespace qdmd
