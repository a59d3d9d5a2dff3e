// SPDX-License-Identifier: LGPL-2.1-or-later
// A picture that has its own memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/channels.h"
#include "core/planes/samples.h"

namespace qdmd {

struct OwnedPicture {
  int depth = 8;                          // bits of a sample, 8 to 16
  std::vector<uint8_t> level[kChannels];  // the samples' highest eight bits
  std::vector<uint8_t> below[kChannels];  // the bits below them; empty where there are none

  // May throw std::bad_alloc. What the planes hold is undefined then.
  void resize(size_t pixels, int bits) {
    depth = bits;
    for (auto& plane : level) plane.resize(pixels);
    for (auto& plane : below) plane.resize(bits > 8 ? pixels : 0);
  }
  Samples samples(size_t channel) const {
    return {level[channel].data(), depth > 8 ? below[channel].data() : nullptr};
  }
  MutableSamples samples(size_t channel) {
    return {level[channel].data(), depth > 8 ? below[channel].data() : nullptr};
  }
};

}  // namespace qdmd
