// SPDX-License-Identifier: LGPL-2.1-or-later
// What frames and background differ in, in one pass over bytes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qdmd {

// out[p] = |x[p] - l[p]|.
void absolute_residual(const uint8_t* x, const uint8_t* l, size_t count, uint8_t* out);

// out[p] = the quaternion norm of x[p] - l[p] in 1/steps level, rounded down, at most 255. x, l: R,
// G, B; steps: 1 or 4.
void residual_norm(const uint8_t* const x[3], const uint8_t* const l[3], size_t count, uint8_t* out,
                   int steps = 1);

// out[p] = the same in 1/kResidualSteps level, at most 255 sqrt(3) levels; and kResidualBeyond more
// where it exceeds the pixel's limit. limits: or null, for 0.
constexpr int kResidualSteps = 8;
constexpr uint16_t kResidualBeyond = 442 * kResidualSteps;
void residual_steps(const uint8_t* const x[3], const uint8_t* const l[3], size_t count,
                    const uint8_t* limits, uint16_t* out);

// out[p] = 255 where the quaternion norm of x - l exceeds `threshold` (grey levels, >= 0; a norm is
// at most 255 sqrt(3)) and the pixel's own limit, else 0. x, l: R, G, B. limits: or null, for none.
void foreground_mask(const uint8_t* const x[3], const uint8_t* const l[3], size_t count,
                     double threshold, const uint8_t* limits, uint8_t* out);

// out[p] = x[p] where mask[p] is 255, 0 where it is 0.
void apply_mask(const uint8_t* x, const uint8_t* mask, size_t count, uint8_t* out);

}  // namespace qdmd
