// The parts of a pixel, and the light on them.
#pragma once

#include <array>

namespace qdmd {

constexpr int kChannels = 3;  // R, G, B: the i, j and k parts of a pixel's pure quaternion

// How much brighter than another picture of the scene one is, in R, G and B; 1: the same light.
using Gain = std::array<float, kChannels>;
constexpr Gain kSameLight = {1, 1, 1};
inline bool is_lit(const Gain& gain) { return gain != kSameLight; }

}  // namespace qdmd
