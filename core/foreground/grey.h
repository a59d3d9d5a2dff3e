// SPDX-License-Identifier: LGPL-2.1-or-later
// Whether a picture has colours: what infra-red cameras send as R, G and B, or as Y, U and V, has
// none.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/colours.h"

namespace qdmd {

// True where at most one of 200 sampled pixels has a colour: samples of channels that differ by
// more than 3, of Y, U and V chroma that is further than that from `neutral`. x: width * height
// samples a channel.
bool is_grey(const uint8_t* const x[3], size_t width, size_t height, Colours colours,
             const uint8_t neutral[3]);

}  // namespace qdmd
