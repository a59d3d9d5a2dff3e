// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

// Of the beam on the ground, in heights of the frame.
constexpr double kLong = 0.35, kHigh = 0.15, kEdge = 0.7;

class Headlights : public Effect {
 public:
  Headlights(Values values, const StreamSource&)
      : strength_(values[0]), y_(values[1]), times_(values.last(3)) {}

  void plan(Plan& plan) override { width_ = plan.width, height_ = plan.height; }

  // From beyond the left rim to beyond the right one.
  void light(double time, Light* light) const override {
    const std::optional<double> since = times_.since(time);
    if (!since) return;
    const double reach = kLong * height_;
    const double x = *since / times_.seconds() * (width_ + 2 * reach) - reach;
    light->local.push_back({x, y_ * height_, reach, kHigh * height_, kEdge, strength_});
  }

 private:
  double strength_, y_;
  double width_ = 1, height_ = 1;
  Times times_;
};

constexpr Parameter kParameters[] = {
    {"strength", "of the light", 0.8, 0, 20, "what they add where they are brightest"},
    {"y", "of the height", 0.75, 0, 1, "where they sweep"},
    Times::kFrom,
    {"seconds", "s", 3, 0, 1e6, "how long they take from side to side"},
    {"every", "s", 6, 0, 1e6, "after which others come; 0: never"},
};

}  // namespace

const EffectInfo kHeadlights = {
    "headlights",
    "local light: headlights of a car out of view sweep over the ground; they are background",
    kLight,
    kBuffers,
    kParameters,
    make_effect<Headlights>};

}  // namespace qdmd::scene
