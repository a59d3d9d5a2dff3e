// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/full_depth.h"

#include <algorithm>
#include <cstring>

#include "core/passes/digits.h"
#include "core/passes/residual.h"

namespace qdmd {
namespace {

// Pixels that are compared together: few differ.
constexpr size_t kTogether = 64;

// Squared norms in units of the lowest bit, of at most kTogether pixels.
void find_units(const Comparison& frame, size_t first, size_t count, uint64_t* units) {
  uint16_t level[kChannels][kTogether];
  uint16_t* const made[3] = {level[0], level[1], level[2]};
  frame.model->evaluate_deep(first, count, made);
  const Samples x[3] = {frame.x[0] + first, frame.x[1] + first, frame.x[2] + first};
  const uint16_t* const l[3] = {level[0], level[1], level[2]};
  squared_units(x, frame.model->depth(), l, count, units);
}

}  // namespace

void full_depth_mask(const Comparison& frame, const uint8_t* const level[3], double threshold,
                     size_t first, size_t count, uint8_t* out) {
  const uint8_t* const x[3] = {frame.x[0].high + first, frame.x[1].high + first,
                               frame.x[2].high + first};
  if (threshold < kCutLevels)
    std::memset(out, 255, count);
  else
    foreground_mask(x, level, count, threshold - kCutLevels, nullptr, out);
  const double in_units = threshold * (1 << bits_below(frame.model->depth()));
  const auto most = static_cast<uint64_t>(std::min(in_units * in_units, 1e15));
  for (size_t p = 0; p < count; p += kTogether) {
    const size_t size = std::min(kTogether, count - p);
    if (!std::memchr(out + p, 255, size)) continue;
    uint64_t units[kTogether];
    find_units(frame, first + p, size, units);
    for (size_t i = 0; i < size; ++i) out[p + i] = units[i] > most ? 255 : 0;
  }
}

void full_depth_distance(const Comparison& frame, size_t first, size_t count, uint16_t* out) {
  const int shift = 2 * bits_below(frame.model->depth());
  const uint64_t below = (uint64_t{1} << shift) - 1;
  for (size_t p = 0; p < count; p += kTogether) {
    const size_t size = std::min(kTogether, count - p);
    uint64_t units[kTogether];
    find_units(frame, first + p, size, units);
    for (size_t i = 0; i < size; ++i)
      out[p + i] = static_cast<uint16_t>(std::min<uint64_t>((units[i] + below) >> shift, 65535));
  }
}

}  // namespace qdmd
