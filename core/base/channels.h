// SPDX-License-Identifier: LGPL-2.1-or-later
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
// The gain of luma, of something grey.
inline float luma_gain(const Gain& gain) {
  return 0.299f * gain[0] + 0.587f * gain[1] + 0.114f * gain[2];
}

// What light may make of samples, 0 .. 255: `dark` stays what it is (black of R, G and B, and of Y;
// U and V without colour).
struct SampleRange {
  std::array<uint8_t, kChannels> dark = {0, 0, 0}, least = {0, 0, 0}, most = {255, 255, 255};
  // Y, U and V: what they become more where R, G or B of a middle grey become so many times more
  // than its luma.
  bool is_yuv = false;
  std::array<std::array<float, kChannels>, kChannels> tint = {};
};

// Samples become factor times what they are, and `offset` more, from least to most.
struct LevelMap {
  float factor = 1, offset = 0, least = 0, most = 255;

  bool changes() const { return factor != 1 || offset != 0; }
};

// What light, a gain of R, G and B, does to samples: each becomes gain (sample - dark) + dark +
// tint. Of Y, U and V the gain is luma's, and other colours of the light tint what is grey.
struct SampleLight {
  Gain gain = kSameLight;  // of the samples
  SampleRange range = {};
  std::array<float, kChannels> tint = {};  // levels

  SampleLight(const Gain& of, const SampleRange& all = {}) : gain(of), range(all) {  // NOLINT
    if (!range.is_yuv || (of[0] == of[1] && of[0] == of[2])) return;
    const float luma = luma_gain(of);
    gain.fill(luma);
    for (size_t c = 0; c < kChannels; ++c)
      for (size_t k = 0; k < kChannels; ++k) tint[c] += range.tint[c][k] * (of[k] - luma);
  }
  bool changes() const { return is_lit(gain) || tint != std::array<float, kChannels>{}; }
  // From unit light into this one, and back.
  LevelMap into(size_t channel) const { return map(gain[channel], tint[channel], channel); }
  LevelMap back(size_t channel) const {
    return map(1 / gain[channel], -tint[channel] / gain[channel], channel);
  }

 private:
  LevelMap map(float factor, float more, size_t channel) const {
    return {factor, static_cast<float>(range.dark[channel]) * (1 - factor) + more,
            static_cast<float>(range.least[channel]), static_cast<float>(range.most[channel])};
  }
};

}  // namespace qdmd
