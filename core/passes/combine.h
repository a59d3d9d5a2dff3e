// SPDX-License-Identifier: LGPL-2.1-or-later
// Linear combinations of planes: the frames' into pictures of modes, the pictures' into L(t).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace qdmd {

// Pixels that levels_of and the callers' buffers hold at once.
constexpr size_t kMaxRun = 1024;

// sums[k][p] = the inner product of sum k's coefficients with planes[0 .. plane_count - 1][first +
// p] for k < sum_count and p < count, in double, rounded once to float: at full rank the
// coefficients of nearly parallel frames cancel, and sums in single precision would show it.
// Coefficients come in groups of four sums: that of sum 4 g + i with plane j is at 4 (g plane_count
// + j) + i, and the last group is full. `first` is a multiple of 64, planes can be read up to the
// next multiple of 64 behind the last pixel.
void combine_planes(const double* coefficients, size_t sum_count, const uint8_t* const* planes,
                    size_t plane_count, size_t first, size_t count, float* const* sums);
// combine_planes() for samples of 16 bits.
void combine_planes(const double* coefficients, size_t sum_count, const uint16_t* const* planes,
                    size_t plane_count, size_t first, size_t count, float* const* sums);

// out[c][p] = sum over k < picture_count of weights[c * picture_count + k] * pictures[k][first + p]
// for c < 3 and p < count <= kMaxRun, in float, rounded to nearest (halves up) and clamped to
// 0 .. 255; not-a-number gives 0. offset[c] is added before that.
using Offset = std::array<float, 3>;
void levels_of(const float* weights, const float* const* pictures, size_t picture_count,
               size_t first, size_t count, uint8_t* const out[3], const Offset& offset = {});
// levels_of(), but rounded down.
void high_digits_of(const float* weights, const float* const* pictures, size_t picture_count,
                    size_t first, size_t count, uint8_t* const out[3], const Offset& offset = {});
// levels_of() in units of the lowest of `depth` bits, of which a level is the eighth from above:
// rounded to nearest and clamped to what they hold.
void deep_levels_of(const float* weights, const float* const* pictures, size_t picture_count,
                    int depth, size_t first, size_t count, uint16_t* const out[3],
                    const Offset& offset = {});

// Pictures of `count` samples, one after another, become the three that the 3 x picture_count
// weights and the offset make of them, before rounding: these take the places of the first three,
// for which there is room. The same bits on every instruction set.
void levels_in_place(const float* weights, size_t picture_count, size_t count, float* samples,
                     const Offset& offset = {});

}  // namespace qdmd
