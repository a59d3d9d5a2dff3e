// SPDX-License-Identifier: LGPL-2.1-or-later
// Rows of a larger picture from those of a smaller one.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// scale is 2 or 4: each sample stands for so many of `out`, which has `width` samples, more than
// those of count - 1 and at most those of `count`.

// out[p] = row[p / scale].
void repeat_row(const uint8_t* row, int scale, size_t width, uint8_t* out);

// What lies between the middles of samples, bilinearly, rounded. phase: 0 .. scale - 1, which of
// the rows that `row` stands for it is. beside: the row above, where it is in the first half of
// these, else the row below; `row` itself, where there is none.
void enlarge_row(const uint8_t* row, const uint8_t* beside, size_t count, int scale, int phase,
                 size_t width, uint8_t* out);

// Where in a mask's pixel at its edge the edge is: half-way up what the frame differs by around it.
// residual, beside: as `row` and `beside` of enlarge_row(), of lengths that are 0 outside of the
// mask; both have one sample more on both sides. means: see find_means(). mask: 255 or 0, of
// `count` pixels. out[p] = mask[p / scale] where the length there is at least 9/16 of means[p /
// scale], else 0: pixels at the edge make means less.
void edge_row(const uint8_t* residual, const uint8_t* beside, const uint8_t* means,
              const uint8_t* mask, size_t count, int scale, int phase, size_t width, uint8_t* out);
// means[p] = of pixel p of the middle one of three rows and the eight around it, the mean of the
// lengths where the mask is set, rounded; 0 where it is set at all nine, or at none: no edge is
// near then. Rows have one sample more on both sides: residual[i] and mask[i] are at pixel 0.
void find_means(const uint8_t* const residual[3], const uint8_t* const mask[3], size_t count,
                uint8_t* means);

}  // namespace qdmd
