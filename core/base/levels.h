// SPDX-License-Identifier: LGPL-2.1-or-later
// Which samples are black and white.
#pragma once

#include <cstdint>

#include "core/base/channels.h"

namespace qdmd {

// Black and white of each channel. Chroma has one value for both, which is neutral: what is drawn
// in greys between black and white then has no colour.
struct Levels {
  uint8_t black[3] = {0, 0, 0}, white[3] = {255, 255, 255};

  bool is_full() const {
    for (int c = 0; c < 3; ++c)
      if (black[c] != 0 || white[c] != 255) return false;
    return true;
  }
  // Chroma has as many steps on both sides of what has no colour.
  SampleRange range() const {
    SampleRange found;
    const bool all = white[0] - black[0] == 255;
    for (size_t c = 0; c < kChannels; ++c) {
      const bool chroma = white[c] == black[c];
      found.dark[c] = black[c];
      found.least[c] = all ? 0 : chroma ? static_cast<uint8_t>(black[c] - 112) : black[c];
      found.most[c] = all ? 255 : chroma ? static_cast<uint8_t>(black[c] + 112) : white[c];
    }
    return found;
  }
};

}  // namespace qdmd
