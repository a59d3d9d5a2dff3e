// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace qdmd::scene {
namespace {

constexpr double kRise = 0.35;  // of the length: how far the shadow reaches up the picture

class Shadow : public Effect {
 public:
  Shadow(Values values, const StreamSource&)
      : length_(values[1]), softness_(static_cast<int>(values[2])) {
    for (size_t c = 0; c < dark_.size(); ++c) {
      // From red to blue, less is taken.
      const double depth = values[0] * (1 - values[3] * static_cast<double>(c) / 2);
      for (size_t shade = 0; shade < dark_[c].size(); ++shade)
        for (size_t level = 0; level < dark_[c][shade].size(); ++level)
          dark_[c][shade][level] = to_level(static_cast<double>(level) *
                                            (1 - depth * (static_cast<double>(shade) / 255)));
    }
  }

  void ground(FrameState& state, std::span<const Placement> placements) override {
    // As far around the canvas as shadows there soften those in it.
    shade_.resize(state.world.width + 2 * softness_, state.world.height + 2 * softness_);
    shade_.fill(0);
    top_ = shade_.height, bottom_ = 0;
    // Where two shadows meet, the sun is gone once.
    for (const Placement& placement : placements)
      if (!placement.part_of_background) cast(placement, state.margin + softness_);
    if (top_ >= bottom_) return;
    if (softness_ > 0) {
      cv::Mat shade(shade_.height, shade_.width, CV_8U, shade_.samples.data());
      cv::blur(shade, shade, {2 * softness_ + 1, 2 * softness_ + 1});
    }
    const int last = std::min(bottom_, state.world.height);
    for (int y = std::max(top_ - 2 * softness_, 0); y < last; ++y) darken(y, &state);
  }

 private:
  // The figure, laid down to the right: row by row of the ground, the row of the figure whose
  // shadow falls there. The frame begins `margin` pixels inside of the plane.
  void cast(const Placement& placement, int margin) {
    const Sprite& sprite = *placement.sprite;
    const int rows = static_cast<int>(std::ceil(sprite.height() * length_ * kRise));
    const int feet = placement.feet() + margin;
    size_t run = sprite.runs.size();
    for (int i = 0; i < rows; ++i) {
      const int y = feet - 1 - i;
      const int above = static_cast<int>(i / (length_ * kRise));
      const int figure_row = sprite.height() - 1 - above;
      const int x = placement.x + margin + static_cast<int>(std::lround(above * length_));
      while (run > 0 && sprite.runs[run - 1].y >= figure_row) --run;
      if (y < 0 || y >= shade_.height) continue;
      top_ = std::min(top_, y), bottom_ = std::max(bottom_, y + 1);
      for (size_t k = run; k < sprite.runs.size() && sprite.runs[k].y == figure_row; ++k) {
        const int left = std::max(x + sprite.runs[k].x, 0);
        const int right = std::min(x + sprite.runs[k].x + sprite.runs[k].length, shade_.width);
        if (left < right) std::fill_n(shade_.at(left, y), right - left, uint8_t{255});
      }
    }
  }

  void darken(int y, FrameState* state) const {
    const uint8_t* shade = shade_.at(softness_, y + softness_);
    for (int x = 0; x < state->world.width; ++x) {
      if (shade[x] == 0) continue;
      *state->shadow.at(x, y) = 255;
      if (!state->wants(kFrame)) continue;
      uint8_t* pixel = state->picture.at(x, y);
      for (size_t c = 0; c < 3; ++c) pixel[c] = dark_[c][shade[x]][pixel[c]];
    }
  }

  double length_;
  int softness_;
  // By channel and shade, 255 where the sun is gone.
  std::array<std::array<std::array<uint8_t, 256>, 256>, 3> dark_{};
  Plane shade_;
  int top_ = 0, bottom_ = 0;  // rows of the plane into which a shadow was cast
};

constexpr Parameter kParameters[] = {
    {"depth", "of the light", 0.45, 0, 1, "what of the light the shadow takes"},
    {"length", "heights", 0.5, 0, 3, "length of the shadow over the height of the object"},
    {"softness", "px", 0, 0, 50, "how far the shadow's edge fades to either side of where it is",
     true},
    {"blue", "of the depth", 0, 0, 1,
     "by how much less the shadow takes of blue than of red: the sky's light is left"},
};

}  // namespace

const EffectInfo kShadow = {
    "shadow",    "a low sun: objects cast shadows on the ground, which the labels mark apart",
    kGround,     kBuffers,
    kParameters, make_effect<Shadow>};

}  // namespace qdmd::scene
