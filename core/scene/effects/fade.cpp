// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

class Fade : public Effect {
 public:
  Fade(Values values, const StreamSource&)
      : depth_(values[0]), duration_(values[1]), from_(values[2]) {}

  void light(double time, Light* light) const override {
    light->scale(1 - depth_ * std::clamp((time - from_) / duration_, 0.0, 1.0));
  }

 private:
  double depth_, duration_, from_;
};

constexpr Parameter kParameters[] = {
    {"depth", "of the light", 0.4, -1, 1, "what is lost in the end; negative: gained"},
    {"duration", "s", 8, 0.001, 1e6, "how long it takes"},
    {"from", "s", 0, 0, 1e6, "when it begins"},
};

}  // namespace

const EffectInfo kFade = {
    "fade",      "gradual change of light: it falls (or grows) evenly, and stays",
    kLight,      0,
    kParameters, make_effect<Fade>};

}  // namespace qdmd::scene
