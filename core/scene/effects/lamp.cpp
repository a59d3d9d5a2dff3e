// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

class Lamp : public Effect {
 public:
  Lamp(Values values, const StreamSource&)
      : strength_(values[0]),
        x_(values[1]),
        y_(values[2]),
        radius_(values[3]),
        times_(values.last(3)) {}

  void plan(Plan& plan) override {
    x_ *= plan.width, y_ *= plan.height;
    radius_ *= std::min(plan.width, plan.height);
  }

  void light(double time, Light* light) const override {
    if (times_.on(time)) light->local.push_back({x_, y_, radius_, radius_, 1, strength_});
  }

 private:
  double strength_, x_, y_, radius_;
  Times times_;
};

constexpr Parameter kParameters[] = {
    {"strength", "of the light", 0.6, -1, 4, "what it adds where it is brightest"},
    {"x", "of the width", 0.05, 0, 1, "where that is"},
    {"y", "of the height", 0.05, 0, 1, "where that is"},
    {"radius", "of the short side", 0.7, 0.01, 10, "how far it reaches"},
    {"from", "s", 4, 0, 1e6, "when it is switched on"},
    {"seconds", "s", 4, 0, 1e6, "how long it is on"},
    {"every", "s", 8, 0, 1e6, "after which it is switched on again; 0: never"},
};

}  // namespace

const EffectInfo kLamp = {
    "lamp",      "local light: a lamp in a corner is switched on and off; it is background",
    kLight,      kBuffers,
    kParameters, make_effect<Lamp>};

}  // namespace qdmd::scene
