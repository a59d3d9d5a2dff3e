// SPDX-License-Identifier: LGPL-2.1-or-later
// A polished floor in which whoever stands on it is seen upside down.
#include "core/scene/effects/infos.h"

#include <cmath>

namespace qdmd::scene {
namespace {

class Mirror : public Effect {
 public:
  Mirror(Values values, const StreamSource&) : strength_(values[0]), reach_(values[1]) {}

  void ground(FrameState& state, std::span<const Placement> placements) override {
    for (const Placement& placement : placements)
      if (!placement.part_of_background) reflect(placement, &state);
  }

 private:
  void reflect(const Placement& placement, FrameState* state) const {
    const Sprite& sprite = *placement.sprite;
    for (const Sprite::Run& run : sprite.runs) {
      const int below = sprite.height() - 1 - run.y;
      const int y = placement.feet() + state->margin + below;
      const double faded = 1 - (below + 0.5) / (reach_ * sprite.height());
      // In 1/256. What would change no level is no mirror image either.
      const auto weight = static_cast<int>(std::lround(256 * strength_ * faded));
      if (weight <= 0 || y < 0 || y >= state->world.height) continue;
      const int x = placement.x + state->margin + run.x;
      const int left = std::max(x, 0), right = std::min(x + run.length, state->world.width);
      if (left < right)
        blend(sprite.picture.at(run.x + left - x, run.y), weight, left, right, y, state);
    }
  }

  static void blend(const uint8_t* image, int weight, int left, int right, int y,
                    FrameState* state) {
    std::fill(state->shadow.at(left, y), state->shadow.row(y) + right, uint8_t{255});
    if (!state->wants(kFrame)) return;
    uint8_t* floor = state->picture.at(left, y);
    for (int i = 0; i < 3 * (right - left); ++i)
      floor[i] = static_cast<uint8_t>(((256 - weight) * floor[i] + weight * image[i] + 128) >> 8);
  }

  double strength_, reach_;
};

constexpr Parameter kParameters[] = {
    {"strength", "of the light", 0.35, 0, 1, "what the floor mirrors at the feet"},
    {"reach", "heights", 0.8, 0.01, 1, "how far from the feet nothing is mirrored any more"},
};

}  // namespace

const EffectInfo kMirror = {
    "mirror",
    "a polished floor: objects are seen in it upside down, fading from their feet on; the labels "
    "mark that as shadow",
    kGround,
    0,
    kParameters,
    make_effect<Mirror>};

}  // namespace qdmd::scene
