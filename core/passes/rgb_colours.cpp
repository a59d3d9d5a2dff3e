// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/rgb_colours.h"

#include <algorithm>
#include <cmath>

namespace qdmd {
namespace {

RgbColours::Pixel read(const uint8_t* const row[kChannels], size_t p) {
  return {static_cast<float>(row[0][p]), static_cast<float>(row[1][p]),
          static_cast<float>(row[2][p])};
}

void write(const RgbColours::Pixel& pixel, size_t p, uint8_t* const row[kChannels]) {
  for (size_t c = 0; c < kChannels; ++c)
    row[c][p] = static_cast<uint8_t>(std::clamp(pixel[c] + 0.5f, 0.0f, 255.0f));
}

}  // namespace

RgbColours::RgbColours(Colours colours, const Levels& levels) : converts_(colours == Colours::yuv) {
  if (!converts_) return;
  const auto range = static_cast<float>(levels.white[0] - levels.black[0]);
  // Chroma has 112 steps on each side where luma has 219, and 127.5 where it has 255.
  const float y = range / 255, chroma = range < 255 ? 112 / 127.5f : 1;
  matrix_ = {{{1 / y, 0, 1.402f / chroma},
              {1 / y, -0.344136f / chroma, -0.714136f / chroma},
              {1 / y, 1.772f / chroma, 0}}};
  back_ = {{{0.299f * y, 0.587f * y, 0.114f * y},
            {-0.168736f * chroma, -0.331264f * chroma, 0.5f * chroma},
            {0.5f * chroma, -0.418688f * chroma, -0.081312f * chroma}}};
  for (size_t c = 0; c < kChannels; ++c)
    for (size_t k = 0; k < kChannels; ++k)
      offset_[c] -= matrix_[c][k] * static_cast<float>(levels.black[k]);
}

SampleRange RgbColours::range(const Levels& levels) const {
  constexpr float kMiddle = 110;  // R, G and B of a middle grey
  SampleRange found = levels.range();
  found.is_yuv = converts_;
  if (!converts_) return found;
  for (size_t c = 0; c < kChannels; ++c)
    for (size_t k = 0; k < kChannels; ++k) found.tint[c][k] = kMiddle * back_[c][k];
  return found;
}

void RgbColours::convert(size_t count, float* const samples[kChannels]) const {
  if (!converts_) return;
  for (size_t p = 0; p < count; ++p) {
    const Pixel out = rgb({samples[0][p], samples[1][p], samples[2][p]});
    for (size_t c = 0; c < kChannels; ++c) samples[c][p] = std::clamp(out[c], 0.0f, 255.0f);
  }
}

void RgbColours::clip(size_t count, float* const samples[kChannels]) const {
  if (!converts_) return;
  for (size_t p = 0; p < count; ++p) {
    Pixel of = rgb({samples[0][p], samples[1][p], samples[2][p]});
    if (std::max({of[0], of[1], of[2]}) <= 255) continue;
    for (float& level : of) level = std::min(level, 255.0f);
    of = sample(of);
    for (size_t c = 0; c < kChannels; ++c) samples[c][p] = of[c];
  }
}

void RgbColours::raise_ends(size_t count, float end, const Gain& gain,
                            const uint8_t* const x[kChannels],
                            uint8_t* const level[kChannels]) const {
  if (!converts_) {
    for (size_t c = 0; c < kChannels; ++c) {
      if (gain[c] >= 1) continue;
      const auto least = static_cast<uint8_t>(std::ceil(std::max(end * gain[c], 1.0f)));
      for (size_t p = 0; p < count; ++p)
        level[c][p] = level[c][p] >= least && x[c][p] > level[c][p] ? x[c][p] : level[c][p];
    }
    return;
  }
  for (size_t p = 0; p < count; ++p) {
    Pixel of = rgb(read(level, p));
    if (std::max({of[0] - end * gain[0], of[1] - end * gain[1], of[2] - end * gain[2]}) < 0)
      continue;
    const Pixel seen = rgb(read(x, p));
    for (size_t c = 0; c < kChannels; ++c)
      if (gain[c] < 1 && of[c] >= end * gain[c]) of[c] = std::max(of[c], seen[c]);
    write(sample(of), p, level);
  }
}

}  // namespace qdmd
