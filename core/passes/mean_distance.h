// SPDX-License-Identifier: LGPL-2.1-or-later
// Mean distances of pixels, and limits that follow from them, in one pass over a row.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// The largest distance that counts, in levels.
constexpr float kMostMeanDistance = 100;

// Moves mean[p], in 1/256 level, by `share` of the way, 0 to 1, towards the distance whose square
// is squared[p], at most kMostMeanDistance.
void learn_distance(const uint16_t* squared, size_t count, float share, uint16_t* mean);

// limit[p] = the larger of limit[p] and `factor` / 256 of the mean, in levels, at most 255. factor:
// below 65536.
void raise_limit(const uint16_t* mean, int factor, size_t count, uint8_t* limit);

// mask[p] = 0 where the distance is at most limit[p] levels.
void keep_beyond(const uint16_t* squared, const uint8_t* limit, size_t count, uint8_t* mask);

// How means follow what a frame showed.
struct NoiseRates {
  int factor = 0;           // a pixel's limit is raised as raise_limit() has it
  int most_of_moments = 0;  // in 1/256 of that limit
  // Shares of the way to the newest, 0 to 1: for background, and for foreground that was none
  // before.
  float share = 0, share_of_moments = 0;
};

// Moves mean[p] as learn_distance() has it, by `share` where near[p] is 0 and the distance within
// the raised limit; where now[p] is 255 and before[p] is 0, by `share_of_moments`, and towards at
// most so many limits. limit: levels, as yet not raised. near is not 0 where now is 255.
void learn_noise(const uint16_t* squared, const uint8_t* limit, const uint8_t* near,
                 const uint8_t* now, const uint8_t* before, const NoiseRates& rates, size_t count,
                 uint16_t* mean);

}  // namespace qdmd
