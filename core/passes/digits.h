// SPDX-License-Identifier: LGPL-2.1-or-later
// Samples of more than 8 bits: as the two digits that frames are kept in, as numbers, and as the
// words of video in memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/image_view.h"
#include "core/planes/samples.h"

namespace qdmd {

// The high digit of a sample is its highest 8 bits, the low digit the bits below them. Distances
// between words are in bytes. 8-bit samples have no digits: depths here are 9 to 16.

// to[p] = the digits of the word at from + p * stride, p < count. Reads nothing behind the last
// word.
void split_digits(const uint8_t* from, ptrdiff_t stride, SampleBits bits, size_t count,
                  MutableSamples to);
// to[p] = the digits of from[p].
void split_digits(const uint16_t* from, int depth, size_t count, MutableSamples to);
// out[p] = from[p], of both digits.
void join_digits(Samples from, int depth, size_t count, uint16_t* out);
// The words at to + p * stride become the samples.
void put_words(const uint16_t* samples, SampleBits bits, size_t count, uint8_t* to,
               ptrdiff_t stride);
// put_words() for words that lie side by side, in pairs or in fours.
void put_pairs(const uint16_t* const samples[2], SampleBits bits, size_t count, uint8_t* to);
void put_fours(const uint16_t* const samples[4], SampleBits bits, size_t count, uint8_t* to);

// Samples of any depth, 8 included: to[p] = the one of pixel p of a row that begins at `from` and
// lies as `at` says, p < count. room: of 2 count bytes, where there are more than 8 bits and pixels
// of a row share samples; else it may be null.
void take_row(const uint8_t* from, const Spacing& at, SampleBits bits, size_t count, uint8_t* room,
              MutableSamples to);
// Whether all samples are value[0], of any depth.
bool are_all(Samples samples, Samples value, size_t count);

// out[p] = the squared quaternion norm of x[p] - l[p] in units of the lowest bit. R, G, B; l: whole
// samples.
void squared_units(const Samples x[3], int depth, const uint16_t* const l[3], size_t count,
                   uint64_t* out);

// What core/passes/chroma.h and soft_edge.h have for bytes.

// out[k] = the mean of those of above[2 k], above[2 k + 1], below[2 k] and below[2 k + 1] that
// there are, halves rounded up, for k < (count + 1) / 2. count: of a row. below: may be null.
void mean_of_pairs(const uint16_t* above, const uint16_t* below, size_t count, uint16_t* out);
// out[p] = black + (white - black) x[p] / 255, rounded.
void fit_levels(const uint8_t* x, uint16_t black, uint16_t white, size_t count, uint16_t* out);
// out[p] = min(black + |x[p] - l[p]|, white).
void residual_levels(const uint16_t* x, const uint16_t* l, uint16_t black, uint16_t white,
                     size_t count, uint16_t* out);
// out[p] = black where alpha[p] is 0, x[p] where it is 255, and what is in between, rounded.
void fade(const uint16_t* x, const uint8_t* alpha, uint16_t black, size_t count, uint16_t* out);

}  // namespace qdmd
