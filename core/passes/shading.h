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

// out[p] = 255 where the pixel differs and x = a L + rest with a = <x, L> / <L, L> in 0.5 .. 1.15,
// where |rest| is at most half of the pixel's limit, and where one gain for the pixels around that
// differ, too, leaves at most 3/4 of it (root of the mean square); else 0. Both may be 3 levels
// where the limit is low. The inner product of two pixels is the real part of conj(x) L, less
// `black`, the samples of R, G and B without light, 0 to 128. x, l: kShadingAlong rows of R, then
// of G and B, each with kShadingReach samples more on both sides; differing: as many rows of 255 or
// 0. limit: levels.
void find_shaded(const uint8_t* const* x, const uint8_t* const* l, const uint8_t* black,
                 const uint8_t* const* differing, const uint8_t* limit, size_t count, uint8_t* out);

}  // namespace qdmd
