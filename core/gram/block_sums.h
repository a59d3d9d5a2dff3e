// SPDX-License-Identifier: LGPL-2.1-or-later
// Sums of the pixels that share a chroma sample, as two 8-bit digits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// Sums each two neighbours of a row, or of two rows: 4 high[k] + low[k] = above[2 k] +
// above[2 k + 1] + below[2 k] + below[2 k + 1], as far as there are such pixels, with low[k] < 4,
// for k < (count + 1) / 2. count: pixels of a row. below: may be null.
void block_sums(const uint8_t* above, const uint8_t* below, size_t count, uint8_t* high,
                uint8_t* low);

}  // namespace qdmd
