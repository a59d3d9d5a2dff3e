// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include "core/scene/effects/times.h"
#include "core/scene/paint.h"

namespace qdmd::scene {
namespace {

class Infrared : public Effect {
 public:
  Infrared(Values values, const StreamSource&) : brightness_(values[0]), times_(values.last(3)) {}

  void meter(double time, Light* light) const override {
    if (times_.on(time)) light->grey = brightness_;
  }

  // The noise of a camera without colour has none either.
  void sensor(FrameState& state) override {
    if (times_.on(state.time)) take_colour(1, &state.picture);
  }

 private:
  double brightness_;
  Times times_;
};

constexpr Parameter kParameters[] = {
    {"brightness", "of the luma", 1.15, 0.1, 4, "levels of what is seen, over the luma by day"},
    {"from", "s", 6, 0, 1e6, "when colour goes"},
    {"seconds", "s", 8, 0, 1e6, "after which it comes back"},
    Times::kEvery,
};

}  // namespace

const EffectInfo kInfrared = {
    "infrared",
    "night mode: the camera takes its filter away, and sees infra-red and no colour",
    kMeter | kSensor,
    0,
    kParameters,
    make_effect<Infrared>};

}  // namespace qdmd::scene
