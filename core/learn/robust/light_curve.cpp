// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/light_curve.h"

#include <algorithm>
#include <cmath>

#include "core/learn/robust/learning_steps.h"

namespace qdmd {
namespace {

using namespace steps::light;

constexpr float kWidth = 256.0f / LightCurve::kKnots;

size_t part_of(float level) {
  return std::min(LightCurve::kKnots - 1, static_cast<size_t>(std::max(level, 0.0f) / kWidth));
}

// Knots in the middle of their part of the levels: those that few cells say anything of have what
// the nearest other one has.
void spread_knots(const std::array<bool, LightCurve::kKnots>& known,
                  std::array<float, LightCurve::kKnots>* added) {
  const std::array<float, LightCurve::kKnots> found = *added;
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
  using Cell = std::array<float, kChannels>;
  const auto grey = [&](Cell of) {
    if (as_luma) of.fill((of[0] + of[1] + of[2]) / kChannels);
    return of;
  };
  const auto from = [&](size_t cell) {
    Cell of;
    for (size_t c = 0; c < kChannels; ++c) of[c] = picture[c * cells + cell] / gain[c];
    return grey(of);
  };
  const auto to = [&](size_t cell) { return grey({unit[0][cell], unit[1][cell], unit[2][cell]}); };
  // Samples at the end of their range say too little.
  const auto is_measured = [&](size_t cell) {
    for (size_t c = 0; c < kChannels; ++c)
      if (picture[c * cells + cell] >= kMeasured || unit[c][cell] >= kMeasured) return false;
    return true;
  };
  LightCurve curve;
  std::array<std::array<std::vector<float>, kKnots>, kChannels> apart;
  size_t seen = 0;
  for (size_t cell = 0; cell < cells; ++cell) {
    const Cell before = from(cell), now = to(cell);
    if (!is_measured(cell)) continue;
    ++seen;
    for (size_t c = 0; c < (as_luma ? 1 : kChannels); ++c)
      apart[c][part_of(before[c])].push_back(now[c] - before[c]);
  }
  for (size_t c = 0; c < (as_luma ? 1 : kChannels); ++c) {
    std::array<bool, kKnots> known = {};
    for (size_t knot = 0; knot < kKnots; ++knot) {
      std::vector<float>& of = apart[c][knot];
      if (of.size() < kLeastRatios) continue;
      const auto at = of.begin() + std::ssize(of) / 2;
      std::nth_element(of.begin(), at, of.end());
      const float middle = *at;
      // Else something hides most of them.
      known[knot] = 2 * std::count_if(of.begin(), of.end(),
                                      [&](float d) { return std::abs(d - middle) < kNearMedian; }) >
                    std::ssize(of);
      if (known[knot]) curve.added_[c][knot] = middle;
    }
    spread_knots(known, &curve.added_[c]);
  }
  if (as_luma) curve.added_[1] = curve.added_[2] = curve.added_[0];
  size_t agreed = 0, agree = 0;
  for (size_t cell = 0; cell < cells; ++cell) {
    const Cell before = from(cell), now = to(cell);
    if (!is_measured(cell)) continue;
    float away = 0, left = 0;
    for (size_t c = 0; c < kChannels; ++c) {
      away += std::abs(now[c] - before[c]);
      left += std::abs(now[c] - before[c] - curve.at(c, before[c]));
    }
    agreed += away < kChannels * kAgree;
    agree += left < kChannels * kAgree;
  }
  if (static_cast<float>(agree) <=
      static_cast<float>(agreed) + kFollowed * static_cast<float>(seen))
    return {};
  curve.none_ = false;
  return curve;
}

}  // namespace qdmd
