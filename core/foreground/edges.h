// SPDX-License-Identifier: LGPL-2.1-or-later
// The edge of a mask: pixels that show less than half of what is in front are background.
#pragma once

#include <cstdint>

#include "core/foreground/compared_planes.h"

namespace qdmd {

// Lenses, interpolation and compression mix the colours of both sides of an edge. Such a pixel
// differs from L long before it shows most of the thing. With F - L, the mean of x - L of the
// thing's pixels near it, it shows the share a = <x - L, F - L> / |F - L|^2 of the thing.
struct EdgeConstants {
  // Background shows less than this share of the thing. What is left, |x - L - a (F - L)|, is at
  // most so much of |F - L|: else it has colours of its own, and is another part of the thing.
  double half = 0.5, rest = 0.3;
};

struct EdgeView {
  ComparedPlanes planes;
  int width, height;
  // 255 or 0, in row order.
  const uint8_t* mask;
  // Rows begin planes.l_stride samples apart: 255 where the pixels around are in the mask, too,
  // which is what a thing's colour is taken from.
  uint8_t* inside;
};

// Rows first_row .. first_row + rows - 1 of `inside`.
void find_inside(const EdgeView& view, int first_row, int rows);
// Rows of the mask without the pixels of its edge that are background, of the whole `inside`. out:
// rows begin planes.l_stride samples apart. A pixel is at the edge if one of the four beside it is
// black; outside of the picture all is white.
void fit_edges(const EdgeView& view, const EdgeConstants& constants, int first_row, int rows,
               uint8_t* out);

}  // namespace qdmd
