// SPDX-License-Identifier: LGPL-2.1-or-later
// A frame and the background that it is compared with, in their highest 8 bits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// Rows of the frame's planes begin x_stride samples apart, those of L l_stride.
struct ComparedPlanes {
  const uint8_t *x[3], *l[3];
  size_t x_stride, l_stride;
};

}  // namespace qdmd
