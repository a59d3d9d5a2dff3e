// Which samples are black and white.
#pragma once

#include <cstdint>

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
};

}  // namespace qdmd
