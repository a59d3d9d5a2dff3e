// SPDX-License-Identifier: LGPL-2.1-or-later
// Which pixels of a frame do not fit a background picture.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/channels.h"
#include "core/base/step.h"
#include "core/parallel/pool.h"
#include "core/passes/read_samples.h"
#include "core/passes/sampling.h"

namespace qdmd {

// A background picture and how far frames may lie from it; planes of width * height samples.
struct ReferencePicture {
  int width = 0, height = 0;
  std::vector<uint8_t> level[kChannels];  // in unit light
  // Quaternion norm in levels: the mean residual of the 5 x 5 pixels around, above which a pixel is
  // foreground.
  std::vector<uint8_t> threshold;

  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

// A frame's mask is one bit a pixel, set where it is foreground: pixel p in bit p % 8 of byte
// p / 8. Masks have room for whole runs of 64 pixels.
constexpr size_t mask_bytes(size_t pixels) { return (pixels + 63) / 64 * 8; }
inline bool is_masked(const uint8_t* bits, size_t pixel) {
  return (bits[pixel / 8] >> (pixel % 8) & 1) != 0;
}

// The mask of a frame: its residual, averaged over 5 x 5 pixels, exceeds the threshold in most of
// the 7 x 7 pixels around; the border's pixels stand for those outside. x: the frame's planes.
// scratch: mask_scratch_bytes() at an even address, which can serve many calls; threads run this,
// so it takes no memory.
void find_mask(const ReferencePicture& reference, const KeptPicture& x, const SampleLight& light,
               uint8_t* bits, uint8_t* scratch) noexcept;
size_t mask_scratch_bytes(int width, int height);

// A frame's gain over the reference by least squares on the sampled pixels that fit it under a gain
// that is nearly right. It is found in steps, kGainRounds times: sums over sampled rows, which are
// whole numbers, so that those of parts of a picture add up; and the gain that the sums of all say.
// False: too few pixels fit, the gain stays as it is, and there is no next round.
QDMD_STEP int kGainRounds = step("light.gain_rounds", 2);
// Where a smaller share of the samples fits, the gain would be of what moves.
QDMD_STEP double kLeastFits = step("light.least_fits", 0.1);
// bright: pixels with such a sample say no more than "at least". one_gain: all channels have the
// same.
// For each channel x times the reference, and the reference squared, both above dark; pixels that
// fit; all.
using GainSums = std::array<int64_t, 2 * kChannels + 2>;
GainSums gain_sums(const ReferencePicture& reference, const KeptPicture& x,
                   const SampleLight& light, const SampledRows& rows, int bright = 250);
bool refine_gain(const GainSums& sums, Gain* gain, bool one_gain = false);

// out[p] = the mean of the 5 x 5 samples around p; the border's samples stand for those outside.
void blur(const uint8_t* plane, int width, int height, Pool* pool, uint8_t* out);
// The bytes that it takes.
uint64_t blur_bytes(int width, int threads);

}  // namespace qdmd
