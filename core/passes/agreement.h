// SPDX-License-Identifier: LGPL-2.1-or-later
// How many cells of two pictures agree: what tells one light of a scene from another.
#pragma once

#include <cstddef>

namespace qdmd {

struct Agreement {
  size_t seen = 0, agree = 0;  // cells
};

// Of cells with a channel in which both pictures are below `end` (levels) - more says "at least" -
// those whose such channels differ by less than `most` in all, with picture a divided by its gain.
// a, b: three planes of `cells` levels; gain: one a channel, above 0.
Agreement find_agreement(const float* const a[3], const float* const b[3], size_t cells,
                         const float gain[3], float end, float most);

}  // namespace qdmd
