// SPDX-License-Identifier: LGPL-2.1-or-later
// R, G and B of samples, whatever the colours of frames are.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/channels.h"
#include "core/base/colours.h"
#include "core/base/levels.h"

namespace qdmd {

// Light is a gain of R, G and B, their samples end where a sensor's do, and a level means the same
// in each. rgb = matrix . sample + offset: for Y, U and V by ITU-R BT.601, with what the levels say
// of the range; other colours are what they are.
class RgbColours {
 public:
  using Matrix = std::array<std::array<float, kChannels>, kChannels>;
  using Pixel = std::array<float, kChannels>;

  RgbColours() = default;
  RgbColours(Colours colours, const Levels& levels);

  bool converts() const { return converts_; }
  const Matrix& matrix() const { return matrix_; }
  const Pixel& offset() const { return offset_; }

  Pixel rgb(const Pixel& sample) const {
    Pixel out = offset_;
    for (size_t c = 0; c < kChannels; ++c)
      for (size_t k = 0; k < kChannels; ++k) out[c] += matrix_[c][k] * sample[k];
    return out;
  }
  Pixel sample(const Pixel& rgb) const {
    Pixel out = {};
    for (size_t c = 0; c < kChannels; ++c)
      for (size_t k = 0; k < kChannels; ++k) out[c] += back_[c][k] * (rgb[k] - offset_[k]);
    return out;
  }
  // What light may make of samples.
  SampleRange range(const Levels& levels) const;
  // Rows of samples become R, G and B in place, within 0 .. 255.
  void convert(size_t count, float* const samples[kChannels]) const;
  // Rows of samples become what they are once R, G and B are at most 255.
  void clip(size_t count, float* const samples[kChannels]) const;
  // R, G or B of `level` that is `end` times its gain, or more, becomes that of x where x has more:
  // it was known at the end of its range, in more light.
  void raise_ends(size_t count, float end, const Gain& gain, const uint8_t* const x[kChannels],
                  uint8_t* const level[kChannels]) const;

 private:
  bool converts_ = false;
  Matrix matrix_ = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, back_ = matrix_;
  Pixel offset_ = {};
};

}  // namespace qdmd
