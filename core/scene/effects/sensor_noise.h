// SPDX-License-Identifier: LGPL-2.1-or-later
// Shot and read noise of a camera's sensor, as the effects noise and night add it.
#pragma once

#include <array>

#include "core/scene/random.h"
#include "core/scene/raster.h"

namespace qdmd::scene {

// The variance of a level v is read^2 gain^2 + shot gain v in levels squared: amplification by
// `gain` scales the read noise itself, and the levels that one photon makes.
struct NoiseModel {
  double read = 1;  // standard deviation in levels at gain 1
  double shot = 0;  // levels of variance per level at gain 1
  double gain = 1;

  double variance(double level) const { return read * read * gain * gain + shot * gain * level; }
};

class SensorNoise {
 public:
  explicit SensorNoise(const NoiseModel& model);
  // Every sample by itself; clips at 0 and 255.
  void add(Stream& stream, Picture* picture) const;

 private:
  static constexpr int kQuantiles = 1 << 16;

  std::vector<float> normal_;
  std::array<float, 256> deviation_{};
};

}  // namespace qdmd::scene
