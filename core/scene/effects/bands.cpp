// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <numbers>

namespace qdmd::scene {
namespace {

class Bands : public Effect {
 public:
  Bands(Values values, const StreamSource&)
      : depth_(values[0]), frequency_(values[1]), readout_(values[2]) {}

  void plan(Plan& plan) override {
    height_ = plan.height;
    row_time_ = readout_ * plan.interval / height_;
  }

  void light(double time, Light* light) const override {
    light->rows.resize(static_cast<size_t>(height_));
    for (int y = 0; y < height_; ++y)
      light->rows[static_cast<size_t>(y)] =
          1 + depth_ * std::sin(2 * std::numbers::pi * frequency_ * (time + y * row_time_));
  }

 private:
  double depth_, frequency_, readout_;
  int height_ = 1;
  double row_time_ = 0;
};

constexpr Parameter kParameters[] = {
    {"depth", "of the light", 0.1, 0, 1,
     "half of the difference between the brightest and the darkest row"},
    {"frequency", "Hz", 120, 0.01, 10000, "of the light, twice that of the mains"},
    {"readout", "of the frame interval", 0.8, 0, 1,
     "how long the shutter takes from the first row to the last"},
};

}  // namespace

const EffectInfo kBands = {
    "bands",     "rolling bands: lamps on mains flicker while the shutter rolls down the picture",
    kLight,      kBuffers,
    kParameters, make_effect<Bands>};

}  // namespace qdmd::scene
