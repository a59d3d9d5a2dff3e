// The parts of a pixel, and the light on them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace qdmd {

constexpr int kChannels = 3;  // R, G, B: the i, j and k parts of a pixel's pure quaternion

// How much brighter than another picture of the scene one is, in R, G and B; 1: the same light.
using Gain = std::array<float, kChannels>;
constexpr Gain kSameLight = {1, 1, 1};
inline bool is_lit(const Gain& gain) { return gain != kSameLight; }

// What light may make of samples, 0 .. 255: `dark` stays what it is (black of R, G and B, and of Y;
// U and V without colour).
struct SampleRange {
  std::array<uint8_t, kChannels> dark = {0, 0, 0}, least = {0, 0, 0}, most = {255, 255, 255};
};

// Samples become factor times what they are, and `offset` more, from least to most.
struct LevelMap {
  float factor = 1, offset = 0, least = 0, most = 255;
};

// What light does to samples: each becomes gain (sample - dark) + dark.
struct SampleLight {
  Gain gain = kSameLight;
  SampleRange range = {};

  SampleLight(const Gain& of, const SampleRange& all = {}) : gain(of), range(all) {}  // NOLINT
  // From unit light into this one, and back.
  LevelMap into(size_t channel) const { return map(gain[channel], channel); }
  LevelMap back(size_t channel) const { return map(1 / gain[channel], channel); }

 private:
  LevelMap map(float factor, size_t channel) const {
    return {factor, static_cast<float>(range.dark[channel]) * (1 - factor),
            static_cast<float>(range.least[channel]), static_cast<float>(range.most[channel])};
  }
};

}  // namespace qdmd
