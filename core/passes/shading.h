// SPDX-License-Identifier: LGPL-2.1-or-later
// Which pixels of a frame are the background in another light: shadows, and floors that shine.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// The texture of kShadingAlong rows and columns around a pixel is compared.
constexpr int kShadingReach = 2, kShadingAlong = 2 * kShadingReach + 1;

// Pixels that are looked at together, at most: short runs, because what is around is looked at only
// where one of them may be shaded; with what is around, whole vectors.
constexpr size_t kShadingRun = 32 - 2 * kShadingReach;

// What light may do. Shares of 1; limits of pixels are levels.
struct LightRange {
  float darkest = 0.5f, brightest = 1.15f;  // the gain
  // The rest, of the pixel alone, and the root of the mean square around it: at most these shares
  // of its limit, or so many levels where that is more.
  float alone = 0.5f, around = 0.75f, least_rest = 3;
  // The pixel's rest at most so much of its background's |L|: noise must not hide colours.
  float of_level = 0.07f;
};

// A run of pixels and what is around it: the first of kShadingAlong rows of R, G and B of a frame
// and of L, and of 255 where pixels differ, else 0; each with kShadingReach samples more on both
// sides.
struct ShadingRows {
  const uint8_t *x[3], *l[3], *differing;
  size_t x_step, l_step;  // samples from one row to the next; l_step of differing, too
};

// out[p] = 255 where asked[p] is 255 and x = a L + rest with a = <x, L> / <L, L> in the range,
// where |rest| is small, and where one gain for the pixels around that differ, too, leaves little;
// else 0. The inner product of two pixels is the real part of conj(x) L, less `black`, the samples
// of R, G and B without light, 0 to 128. limit: levels. count: kShadingRun at most.
void find_shaded(const ShadingRows& rows, const uint8_t* black, const uint8_t* asked,
                 const uint8_t* limit, const LightRange& range, size_t count, uint8_t* out);

}  // namespace qdmd
