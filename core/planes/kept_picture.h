// SPDX-License-Identifier: LGPL-2.1-or-later
// The planes of a picture, as frames are kept.
#pragma once

#include <cstdint>

#include "core/base/channels.h"
#include "core/planes/chroma_shape.h"
#include "core/planes/samples.h"

namespace qdmd {

// Channels 1 and 2 have the shared samples, where the shape says so.
struct KeptPicture {
  KeptPicture(const uint8_t* const planes[kChannels], const ChromaShape& shared = {})  // NOLINT
      : samples{planes[0], planes[1], planes[2]}, shape(shared) {}
  KeptPicture(const Samples planes[kChannels], const ChromaShape& shared, int bits)
      : samples{planes[0], planes[1], planes[2]}, shape(shared), depth(bits) {}

  // The highest eight bits of the samples.
  const uint8_t* plane(int channel) const { return samples[channel].high; }

  Samples samples[kChannels];
  ChromaShape shape;  // nothing where each pixel has its own samples
  int depth = 8;      // bits of a sample
};

}  // namespace qdmd
