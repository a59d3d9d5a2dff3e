// SPDX-License-Identifier: LGPL-2.1-or-later
// What a gain leaves of a change of light: cameras put a curve behind their exposure.
#pragma once

#include <array>
#include <cstddef>

#include "core/base/channels.h"
#include "core/learn/robust/learning_steps.h"

namespace qdmd {

// A gain carries a place that is hidden now into the light of a window, up to what the camera's
// curve made of other levels. That is the same at all places of one level: those that are seen in
// both lights say it.
class LightCurve {
 public:
  // What is to be added to a level (0 to 255, in unit light) of that channel: R, G or B.
  float at(size_t channel, float level) const;
  // Adds it to a picture's cells, in place.
  void bend(size_t cells, float* picture) const;

  // Adds up curves, and makes a mean of so many.
  void add(const LightCurve& other);
  void divide(size_t count);

  // The curve from a picture's cells, divided by `gain`, to those of `unit`, which has unit light;
  // none where that does not make more cells agree (steps::light::kFollowed). Grows with the level.
  // as_luma: one curve of what R, G and B have in common, for all of them.
  static LightCurve between(const float* picture, const Gain& gain, const float* const unit[3],
                            size_t cells, bool as_luma);
  // True where nothing is added.
  bool none() const { return none_; }

 private:
  std::array<std::array<float, steps::light::kKnots>, kChannels> added_ = {};
  bool none_ = true;
};

}  // namespace qdmd
