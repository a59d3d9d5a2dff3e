// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

// The share of the figures' own texture that is left; the rest is plain cloth.
constexpr double kTexture = 0.1;

class Camouflage : public Effect {
 public:
  Camouflage(Values values, const StreamSource&) : contrast_(values[0]) {}

  void plan(Plan& plan) override {
    plan.dress = [backdrop = plan.backdrop, contrast = contrast_](const Sprite& sprite,
                                                                  const Box& region) {
      auto mean = backdrop->mean(region);
      for (auto& level : mean) level += contrast;
      return repainted(sprite, mean, kTexture);
    };
  }

 private:
  double contrast_;
};

constexpr Parameter kParameters[] = {
    {"contrast", "levels", 10, 0, 100, "how much lighter than that colour they are on average"},
};

}  // namespace

const EffectInfo kCamouflage = {"camouflage",
                                "objects wear the mean colour of the background on their way",
                                0,
                                0,
                                kParameters,
                                make_effect<Camouflage>};

}  // namespace qdmd::scene
