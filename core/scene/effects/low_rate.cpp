// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

class LowRate : public Effect {
 public:
  LowRate(Values values, const StreamSource&) : rate_(values[0]) {}
  void plan(Plan& plan) override { plan.pace = 1 / rate_; }

 private:
  double rate_;
};

constexpr Parameter kParameters[] = {
    {"rate", "frames/s", 2, 0.01, 1000, "frames that the camera takes in a second"},
};

}  // namespace

const EffectInfo kLowRate = {"low-rate",
                             "a slow camera: the scene goes on by 1 / rate seconds from frame to "
                             "frame, whatever the frame rate of the video is",
                             0,
                             0,
                             kParameters,
                             make_effect<LowRate>};

}  // namespace qdmd::scene
