// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>

#include "core/scene/effects/sensor_noise.h"

namespace qdmd::scene {
namespace {

constexpr std::array<double, 3> kMoonlight{0.85, 0.95, 1.2};  // colour of the light
constexpr double kRead = 1, kShot = 0.02;                     // a sensor's noise at gain 1

double amplification(double gain) { return std::pow(10, gain / 20); }

class Night : public Effect {
 public:
  Night(Values values, const StreamSource& streams)
      : level_(values[0] * amplification(values[1])),
        noise_({kRead, kShot, amplification(values[1])}),
        streams_(streams) {}

  void light(double /*time*/, Light* light) const override {
    for (size_t c = 0; c < 3; ++c) light->gain[c] *= level_ * kMoonlight[c];
  }

  void sensor(FrameState& state) override {
    Stream stream = streams_.at(state.index);
    noise_.add(stream, &state.picture);
  }

 private:
  double level_;
  SensorNoise noise_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"light", "of daylight", 0.04, 0.001, 1, "what is left"},
    {"gain", "dB", 18, 0, 40, "amplification, of which 6 dB double the levels"},
};

}  // namespace

const EffectInfo kNight = {
    "night",
    "night: little light, from blue sky, and a camera that amplifies what is left with its noise",
    kLight | kSensor,
    kRandom | kBuffers,
    kParameters,
    make_effect<Night>};

}  // namespace qdmd::scene
