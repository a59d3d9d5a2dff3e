// SPDX-License-Identifier: LGPL-2.1-or-later
// The pixels of a mask overrule those that differ from what is around them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// A pixel of a mask is overruled where three fifths of those at most so many rows and columns from
// it are the other: 2, less in pictures whose short side is below 240 pixels, 0 (it decides alone)
// below 120. Compression, and noise near the threshold, leave specks and holes of single pixels;
// what is as narrow as they are goes with them.
int voting_reach(int width, int height);

// A mask of 255 and 0 before the vote, from its first pixel on: rows `stride` samples apart, which
// have `reach` samples more on both sides.
struct Voters {
  const uint8_t* mask;
  size_t stride;
  int width, height, reach;
};

// Rows first_row .. first_row + row_count - 1 of the mask after the vote, whose rows have no
// margins, into `out`, its first row. Any threads may write different rows.
void vote(const Voters& voters, int first_row, int row_count, uint8_t* out);

}  // namespace qdmd
