// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>

#include "core/scene/effects/sensor_noise.h"

namespace qdmd::scene {
namespace {

NoiseModel model_of(Values values) {
  const double variance = values[0] * values[0], shot = values[1];
  return {std::sqrt(variance * (1 - shot)), variance * shot / 128, std::pow(10, values[2] / 20)};
}

class Noise : public Effect {
 public:
  Noise(Values values, const StreamSource& streams) : noise_(model_of(values)), streams_(streams) {}

  void sensor(FrameState& state) override {
    Stream stream = streams_.at(state.index);
    noise_.add(stream, &state.picture);
  }

 private:
  SensorNoise noise_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"deviation", "levels", 2, 0, 60, "standard deviation at level 128 and gain 0"},
    {"shot", "of the variance", 0.5, 0, 1, "share of the shot noise at level 128 and gain 0"},
    {"gain", "dB", 0, 0, 40,
     "amplification: the read noise grows with it, the variance of the shot noise too"},
};

}  // namespace

const EffectInfo kNoise = {
    "noise",
    "a sensor's noise: shot noise, whose variance grows with the level, and read noise",
    kSensor,
    kRandom | kBuffers,
    kParameters,
    make_effect<Noise>};

}  // namespace qdmd::scene
