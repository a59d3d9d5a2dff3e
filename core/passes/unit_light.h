// Samples under another light: the one rounding that all passes share.
#pragma once

#include <cstdint>

namespace qdmd {

// The sample times `factor` (>= 0), rounded to nearest, at most 255. In loops that the compiler
// makes vectors of.
[[gnu::always_inline]] inline uint8_t in_light(uint8_t sample, float factor) {
  const float level = static_cast<float>(sample) * factor + 0.5f;
  return static_cast<uint8_t>(static_cast<int>(level < 255.0f ? level : 255.0f));
}

// The sample divided by `gain` (> 0), rounded in the same way: for few samples, without the second
// rounding that a product with 1 / gain has.
inline uint8_t out_of_light(uint8_t sample, float gain) {
  const float level = static_cast<float>(sample) / gain + 0.5f;
  return static_cast<uint8_t>(static_cast<int>(level < 255.0f ? level : 255.0f));
}

}  // namespace qdmd
