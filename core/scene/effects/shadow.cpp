#include "core/scene/effects/infos.h"

#include <cmath>

namespace qdmd::scene {
namespace {

constexpr double kRise = 0.35;  // of the length: how far the shadow reaches up the picture

class Shadow : public Effect {
 public:
  Shadow(Values values, const StreamSource&) : depth_(values[0]), length_(values[1]) {
    for (size_t level = 0; level < dark_.size(); ++level)
      dark_[level] = to_level(static_cast<double>(level) * (1 - depth_));
  }

  void ground(FrameState& state, std::span<const Placement> placements) override {
    // Where two shadows meet, the sun is gone once.
    state.shadow.resize(state.world.width, state.world.height);
    state.shadow.fill(0);
    for (const Placement& placement : placements)
      if (!placement.part_of_background) cast(placement, &state);
  }

 private:
  // The figure, laid down to the right: row by row of the ground, the row of the figure whose
  // shadow falls there.
  void cast(const Placement& placement, FrameState* state) {
    const Sprite& sprite = *placement.sprite;
    const int rows = static_cast<int>(std::ceil(sprite.height() * length_ * kRise));
    const int feet = placement.feet() + state->margin;
    size_t run = sprite.runs.size();
    for (int i = 0; i < rows; ++i) {
      const int y = feet - 1 - i;
      const int above = static_cast<int>(i / (length_ * kRise));
      const int figure_row = sprite.height() - 1 - above;
      const int x = placement.x + state->margin + static_cast<int>(std::lround(above * length_));
      while (run > 0 && sprite.runs[run - 1].y >= figure_row) --run;
      if (y < 0 || y >= state->world.height) continue;
      for (size_t k = run; k < sprite.runs.size() && sprite.runs[k].y == figure_row; ++k)
        darken(x + sprite.runs[k].x, y, sprite.runs[k].length, state);
    }
  }

  void darken(int x, int y, int length, FrameState* state) {
    const int right = std::min(x + length, state->world.width);
    for (x = std::max(x, 0); x < right; ++x) {
      if (*state->shadow.at(x, y)) continue;
      *state->shadow.at(x, y) = 255;
      if (!state->wants(kFrame)) continue;
      uint8_t* pixel = state->picture.at(x, y);
      for (int c = 0; c < 3; ++c) pixel[c] = dark_[pixel[c]];
    }
  }

  double depth_, length_;
  std::array<uint8_t, 256> dark_{};
};

constexpr Parameter kParameters[] = {
    {"depth", "of the light", 0.45, 0, 1, "what of the light the shadow takes"},
    {"length", "heights", 0.5, 0, 3, "length of the shadow over the height of the object"},
};

}  // namespace

const EffectInfo kShadow = {
    "shadow",    "a low sun: objects cast shadows on the ground, which the labels mark apart",
    kGround,     kBuffers,
    kParameters, make_effect<Shadow>};

}  // namespace qdmd::scene
