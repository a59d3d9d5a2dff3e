// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>

namespace qdmd::scene {
namespace {

class LightSwitch : public Effect {
 public:
  LightSwitch(Values values, const StreamSource&) : depth_(values[0]), seconds_(values[1]) {}

  void light(double time, Light* light) const override {
    // In whole switches; half a millionth forgives the rounding of the frame's time.
    const auto switches = static_cast<int64_t>(std::floor(time / seconds_ + 5e-7));
    if (switches % 2 == 1) light->scale(1 - depth_);
  }

 private:
  double depth_, seconds_;
};

constexpr Parameter kParameters[] = {
    {"depth", "of the light", 0.35, 0, 1, "what the lamp gave"},
    {"seconds", "s", 4, 0.001, 1e6, "how long it is on, and then off"},
};

}  // namespace

const EffectInfo kLightSwitch = {
    "light-switch", "sudden change of light: a lamp is switched off, and on again",
    kLight,         0,
    kParameters,    make_effect<LightSwitch>};

}  // namespace qdmd::scene
