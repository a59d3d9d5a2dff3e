// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <numbers>

namespace qdmd::scene {
namespace {

class Flicker : public Effect {
 public:
  Flicker(Values values, const StreamSource& streams) : amplitude_(values[0]), streams_(streams) {}

  void plan(Plan& plan) override { backdrop_ = plan.backdrop; }

  void world(FrameState& state) override {
    // Uniform: a screen's range has ends.
    Stream stream = streams_.at(state.index);
    const double change = amplitude_ * std::numbers::sqrt3 * stream.uniform(-1, 1);
    const Box& box = backdrop_->shop_window();
    for (int y = box.y; y < box.bottom(); ++y)
      for (int x = box.x; x < box.right(); ++x)
        for (int c = 0; c < 3; ++c) {
          uint8_t* level = state.world.at(x, y) + c;
          *level = to_level(*level + change);
        }
  }

 private:
  double amplitude_;
  StreamSource streams_;
  const Backdrop* backdrop_ = nullptr;
};

constexpr Parameter kParameters[] = {
    {"amplitude", "levels", 25, 0, 100, "standard deviation of its brightness"},
};

}  // namespace

const EffectInfo kFlicker = {"flicker",
                             "moving background: a screen in the shop window shows another "
                             "brightness in every frame; it is background",
                             kWorld,
                             kRandom,
                             kParameters,
                             make_effect<Flicker>};

}  // namespace qdmd::scene
