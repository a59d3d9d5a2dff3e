// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/light_curve.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace qdmd {
namespace {

using namespace steps::light;

constexpr float kWidth = 256.0f / kKnots;

size_t part_of(float level) {
  return std::min(kKnots - 1, static_cast<size_t>(std::max(level, 0.0f) / kWidth));
}

// Knots in the middle of their part of the levels: those that few cells say anything of have what
// the nearest other one has.
void spread_knots(const std::array<bool, kKnots>& known, std::array<float, kKnots>* added) {
  const std::array<float, kKnots> found = *added;
  for (size_t knot = 0; knot < found.size(); ++knot)
    for (size_t away = 0; away < found.size(); ++away) {
      const bool below = knot >= away && known[knot - away],
                 above = knot + away < found.size() && known[knot + away];
      if (!below && !above) continue;
      (*added)[knot] = !above   ? found[knot - away]
                       : !below ? found[knot + away]
                                : (found[knot - away] + found[knot + away]) / 2;
      break;
    }
  // What is brighter stays so.
  for (size_t knot = 1; knot < found.size(); ++knot)
    (*added)[knot] = std::max((*added)[knot], (*added)[knot - 1] - kWidth);
}

using Cell = std::array<float, kChannels>;

// A cell in both lights.
struct Seen {
  Cell before, now;
};

// Those whose samples are not at the end of their range, where they say too little.
std::vector<Seen> seen_in_both(const float* picture, const Gain& gain, const float* const unit[3],
                               size_t cells, bool as_luma) {
  std::vector<Seen> seen;
  for (size_t cell = 0; cell < cells; ++cell) {
    Seen of;
    bool ends = false;
    for (size_t c = 0; c < kChannels; ++c) {
      const float level = picture[c * cells + cell];
      ends |= level >= kMeasured || unit[c][cell] >= kMeasured;
      of.before[c] = level / gain[c];
      of.now[c] = unit[c][cell];
    }
    if (ends) continue;
    for (Cell* in : {&of.before, &of.now})
      if (as_luma) in->fill(((*in)[0] + (*in)[1] + (*in)[2]) / kChannels);
    seen.push_back(of);
  }
  return seen;
}

size_t count_agreeing(const std::vector<Seen>& seen, const LightCurve& curve) {
  return static_cast<size_t>(std::count_if(seen.begin(), seen.end(), [&](const Seen& cell) {
    float away = 0;
    for (size_t c = 0; c < kChannels; ++c)
      away += std::abs(cell.now[c] - cell.before[c] - curve.at(c, cell.before[c]));
    return away < kChannels * kAgree;
  }));
}

}  // namespace

float LightCurve::at(size_t channel, float level) const {
  const auto& added = added_[channel];
  const float place = std::clamp(level / kWidth - 0.5f, 0.0f, static_cast<float>(kKnots - 1));
  const size_t below = std::min(kKnots - 2, static_cast<size_t>(place));
  const float share = place - static_cast<float>(below);
  return added[below] + share * (added[below + 1] - added[below]);
}

void LightCurve::bend(size_t cells, float* picture) const {
  if (none_) return;
  for (size_t c = 0; c < kChannels; ++c)
    for (size_t cell = 0; cell < cells; ++cell) {
      float& level = picture[c * cells + cell];
      level = std::max(0.0f, level + at(c, level));
    }
}

void LightCurve::add(const LightCurve& other) {
  for (size_t c = 0; c < kChannels; ++c)
    for (size_t knot = 0; knot < kKnots; ++knot) added_[c][knot] += other.added_[c][knot];
  none_ = none_ && other.none_;
}

void LightCurve::divide(size_t count) {
  for (auto& of_channel : added_)
    for (float& added : of_channel) added /= static_cast<float>(count);
}

LightCurve LightCurve::between(const float* picture, const Gain& gain, const float* const unit[3],
                               size_t cells, bool as_luma) {
  const std::vector<Seen> seen = seen_in_both(picture, gain, unit, cells, as_luma);
  LightCurve curve;
  for (size_t c = 0; c < (as_luma ? 1 : kChannels); ++c) {
    std::array<std::vector<float>, kKnots> apart;
    for (const Seen& cell : seen)
      apart[part_of(cell.before[c])].push_back(cell.now[c] - cell.before[c]);
    std::array<bool, kKnots> known = {};
    for (size_t knot = 0; knot < kKnots; ++knot) {
      std::vector<float>& of = apart[knot];
      if (of.size() < kLeastRatios) continue;
      const auto at = of.begin() + std::ssize(of) / 2;
      std::nth_element(of.begin(), at, of.end());
      const float middle = *at;
      const auto near = std::count_if(of.begin(), of.end(),
                                      [&](float d) { return std::abs(d - middle) < kNearMedian; });
      // Else something hides most of them.
      known[knot] = 2 * near > std::ssize(of);
      if (known[knot]) curve.added_[c][knot] = middle;
    }
    spread_knots(known, &curve.added_[c]);
  }
  if (as_luma) curve.added_[1] = curve.added_[2] = curve.added_[0];
  if (static_cast<float>(count_agreeing(seen, curve)) <=
      static_cast<float>(count_agreeing(seen, {})) + kFollowed * static_cast<float>(seen.size()))
    return {};
  curve.none_ = false;
  return curve;
}

}  // namespace qdmd
