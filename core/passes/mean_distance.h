// Mean distances of pixels, and limits that follow from them, in one pass over a row.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// The largest distance that counts, in levels.
constexpr float kMostDistance = 100;

// Moves mean[p], in 1/256 level, by `share` of the way, 0 to 1, towards the distance whose square
// is squared[p], at most kMostDistance; where learns[p] is 0, not.
void learn_distance(const uint16_t* squared, const uint8_t* learns, size_t count, float share,
                    uint16_t* mean);

// limit[p] = the larger of limit[p] and `factor` / 256 of the mean, in levels, at most 255.
void raise_limit(const uint16_t* mean, int factor, size_t count, uint8_t* limit);

}  // namespace qdmd
