// SPDX-License-Identifier: LGPL-2.1-or-later
// Rows whose samples several pixels share, or lie between those of other channels.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// to[p] = from[p / columns * stride] for p < count; columns: 1 or 2. Reads nothing behind the last
// of these samples.
void spread_samples(const uint8_t* from, ptrdiff_t stride, int columns, size_t count, uint8_t* to);

// out[k] = the mean of those of above[2 k], above[2 k + 1], below[2 k] and below[2 k + 1] that
// there are, halves rounded up, for k < (count + 1) / 2. count: of a row. below: may be null.
void mean_of_pairs(const uint8_t* above, const uint8_t* below, size_t count, uint8_t* out);

// out[2 k] = first[k], out[2 k + 1] = second[k] for k < count.
void interleave(const uint8_t* first, const uint8_t* second, size_t count, uint8_t* out);

// out[p] = black + (white - black) x[p] / 255, rounded.
void fit_levels(const uint8_t* x, uint8_t black, uint8_t white, size_t count, uint8_t* out);

// out[p] = min(black + |x[p] - l[p]|, white).
void residual_levels(const uint8_t* x, const uint8_t* l, uint8_t black, uint8_t white, size_t count,
                     uint8_t* out);

// Whether all samples are `value`.
bool are_all(const uint8_t* samples, uint8_t value, size_t count);

}  // namespace qdmd
