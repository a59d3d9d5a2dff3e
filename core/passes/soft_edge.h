// SPDX-License-Identifier: LGPL-2.1-or-later
// The soft edge of a mask: a guided filter, and what fades with it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// Pixels to either side of an edge over which it fades, at most: with more, sums of a window would
// not fit 32 bits.
constexpr int kMostSoftness = 15;
// The side of a tile, at most, and how far around it a softness looks.
constexpr int kSoftTile = 64;
constexpr int soft_halo(int softness) { return 2 * softness; }

// A guided filter (He, Sun, Tang 2010): in each window of (2 softness + 1)^2 pixels the line
// a guide + b that fits the mask best, and for each pixel the mean of the lines of all windows that
// it is in, 0 .. 255. Where all pixels of all of them have one colour, this is the mask.
// guide: levels, of which every second counts; white: 255 or 0; both of a tile of width x height
// pixels with soft_halo() more on all sides, rows `stride` apart, beginning with the halo.
// smooth: windows in which the guide's root mean square is below so many levels are flat, at least
// kLeastSmooth. out: rows `out_stride` apart. Takes 40 KiB of the stack. Sums are exact: the
// same bits for every instruction set.
constexpr float kLeastSmooth = 4;
void soften_tile(const uint8_t* guide, const uint8_t* white, size_t stride, int width, int height,
                 int softness, float smooth, uint8_t* out, size_t out_stride);

// What is left of the edges of frames before. known: the guide that they go by. Where the guide is
// within half of `most` levels of it, alpha[p] goes a sixteenth of the way to soft[p]; half of it
// if that is 0 or 255, or far (96 levels; from 32 on something in between); and not at all if
// soft[p] is neither and within 8 levels. If the guide is further away than `most`, alpha[p]
// becomes soft[p]; in between, something in between. What is known follows the guide by a
// sixteenth.
void settle(const uint8_t* soft, const uint8_t* guide, int most, size_t count, uint8_t* known,
            uint8_t* alpha);

// Whether a mask differs from the one before in more than twice as many pixels as its outline has:
// rows of `width` samples, 255 or 0, of pictures with rows `stride` apart.
bool has_moved(const uint8_t* mask, const uint8_t* before, size_t stride, size_t width,
               size_t height);

// Whether rows of `width` samples, 255 or 0, have both.
bool is_mixed(const uint8_t* mask, size_t stride, size_t width, size_t height);

// out[p] = black where alpha[p] is 0, x[p] where it is 255, and what is in between, rounded.
void fade(const uint8_t* x, const uint8_t* alpha, uint8_t black, size_t count, uint8_t* out);

}  // namespace qdmd
