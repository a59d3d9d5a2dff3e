// SPDX-License-Identifier: LGPL-2.1-or-later
// A scene in other colours: what a camera shows of it once it has switched to infra-red.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/channels.h"
#include "core/model/learnt.h"
#include "core/passes/rgb_colours.h"

namespace qdmd {

// out[c] = row[c][0 .. 2] . in + row[c][3], in levels.
struct ColourMap {
  std::array<std::array<float, kChannels + 1>, kChannels> row;

  std::array<float, kChannels> of(const std::array<float, kChannels>& in) const {
    std::array<float, kChannels> out;
    for (size_t c = 0; c < kChannels; ++c)
      out[c] = row[c][0] * in[0] + row[c][1] * in[1] + row[c][2] * in[2] + row[c][3];
    return out;
  }
};

// Least squares over the cells of a frame and of a background, without those that fit worst: what
// is in front. The map is one of samples, whose cells have these `colours`. Nothing where no map
// explains most of them.
std::optional<ColourMap> find_colour_map(const float* const frame[kChannels],
                                         const float* const background[kChannels], size_t cells,
                                         const RgbColours& colours = {});

// How coloured a picture is: none where hardly any cell has a colour, some where many have. Cells
// with samples at the end of their range, in this picture or the other one (null: there is none),
// have lost their colour and say nothing; little: few others are left.
enum class Colouring { none, little, some };
Colouring colouring_of(const float* const cells[kChannels], const float* const other[kChannels],
                       size_t count);

// `count` pixels of a picture, and what a window knows. What becomes too bright for the samples'
// range ends there, as a camera's does.
void recolour(const ColourMap& map, const SampleRange& range, size_t count,
              uint8_t* const level[kChannels]);
void recolour(const ColourMap& map, const SampleRange& range, Learnt* learnt);

}  // namespace qdmd
