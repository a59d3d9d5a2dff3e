// SPDX-License-Identifier: LGPL-2.1-or-later
// A pixel of a mask is overruled where most of those around it are the other, row by row.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// Rows and columns to either side that vote with a pixel, at most.
constexpr int kMostReach = 2;

// out[p] = how many of padded[p] .. padded[p + 2 reach] are 255; the others are 0. reach: 1 or 2.
void count_columns(const uint8_t* padded, size_t count, int reach, uint8_t* out);

// out[p] = own[p], which is 0 or 255, or the other where three fifths of the pixels that vote are:
// at least 6 of 9, 15 of 25. rows: 2 reach + 1 rows of counts. With half of them, corners of
// objects would be lost.
void vote_row(const uint8_t* const* rows, const uint8_t* own, size_t count, int reach,
              uint8_t* out);

}  // namespace qdmd
