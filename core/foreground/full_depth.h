// SPDX-License-Identifier: LGPL-2.1-or-later
// Samples of more than 8 bits against the background: all of their bits.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/foreground/decision.h"

namespace qdmd {

// The highest 8 bits of two samples are less than a level farther apart or nearer than the samples;
// norms of pixels less than this.
inline constexpr double kCutLevels = 1.7320508;

// Pixels first .. first + count - 1 of the rows that are kept of a frame of more than 8 bits: 255
// where the quaternion norm of x - L exceeds `threshold` levels, else 0. level: L's highest 8
// bits there; only pixels that these do not show to be near are compared in full.
void full_depth_mask(const Comparison& frame, const uint8_t* const level[3], double threshold,
                     size_t first, size_t count, uint8_t* out);

// Squared norms in levels, rounded up, at most 65535: they exceed a whole number where the norms
// do.
void full_depth_distance(const Comparison& frame, size_t first, size_t count, uint16_t* out);

}  // namespace qdmd
