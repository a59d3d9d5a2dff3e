// SPDX-License-Identifier: LGPL-2.1-or-later
// How far a frame's pixels are from the background's: at the same place, and around it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// Places to either side of a pixel, in rows and columns, where the background may have moved from.
constexpr int kPlaces = 2;
constexpr int kPlacesAlong = 2 * kPlaces + 1;

// out[p] = the squared quaternion norm of x[p] - l[p] in levels, at most 65535. x, l: R, G, B.
void squared_distance(const uint8_t* const x[3], const uint8_t* const l[3], size_t count,
                      uint16_t* out);

// out[p] = the least of them over the background's pixels in kPlacesAlong rows and columns around,
// `step` pixels apart. rows[kPlacesAlong * c + i]: channel c of row i - kPlaces, at the column of
// x[c], with kPlaces * step samples more on both sides.
void nearest_distance(const uint8_t* const x[3], const uint8_t* const* rows, size_t count, int step,
                      uint16_t* out);

// squared_distance() of the means over 3 x 3 pixels. x[3 * c + i], l: channel c of row
// i - 1, with one sample more on both sides.
void smoothed_distance(const uint8_t* const* x, const uint8_t* const* l, size_t count,
                       uint16_t* out);

}  // namespace qdmd
