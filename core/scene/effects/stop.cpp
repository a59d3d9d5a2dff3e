// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

class Stop : public Effect {
 public:
  Stop(Values values, const StreamSource&) : seconds_(values[0]) {}
  void plan(Plan& plan) override { plan.pause = seconds_; }

 private:
  double seconds_;
};

constexpr Parameter kParameters[] = {
    {"seconds", "s", 8, 0, 36000, "how long"},
};

}  // namespace

const EffectInfo kStop = {
    "stop",
    "intermittent motion: somebody who crosses the frame stands still in the middle, then goes on",
    0,
    0,
    kParameters,
    make_effect<Stop>};

}  // namespace qdmd::scene
