// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

class Cloud : public Effect {
 public:
  Cloud(Values values, const StreamSource&)
      : depth_(values[0]),
        share_(values[1]),
        edge_(values[2]),
        way_(values[3]),
        times_(values.last(3)) {}

  void plan(Plan& plan) override { width_ = plan.width, height_ = plan.height; }

  // A shadow so large that its edge, which comes from the left and goes back, is a line.
  void light(double time, Light* light) const override {
    const std::optional<double> since = times_.since(time);
    if (!since) return;
    const double there =
        std::clamp(std::min(*since, times_.seconds() - *since) / way_, 0.0, 1.0) * share_;
    const double radius = 2 * width_, fades = std::max(edge_ * width_, 1.0);
    // Half of the fading lies behind the edge.
    const double x = there * (width_ + fades) - radius;
    light->local.push_back({x, height_ / 2, radius, 100 * height_, fades / radius, -depth_});
  }

 private:
  double depth_, share_, edge_, way_;
  double width_ = 1, height_ = 1;
  Times times_;
};

constexpr Parameter kParameters[] = {
    {"depth", "of the light", 0.4, 0, 1, "what it takes"},
    {"share", "of the width", 0.5, 0, 1, "how far it comes"},
    {"edge", "of the width", 0.1, 0, 1, "over which its shadow fades"},
    {"way", "s", 2, 0.001, 1e6, "how long its edge takes to come there, and to go again"},
    {"from", "s", 4, 0, 1e6, "when it comes"},
    {"seconds", "s", 12, 0, 1e6, "how long it is there, both ways included"},
    Times::kEvery,
};

}  // namespace

const EffectInfo kCloud = {
    "cloud",     "local light: the shadow of a cloud comes over a part of the picture",
    kLight,      kBuffers,
    kParameters, make_effect<Cloud>};

}  // namespace qdmd::scene
