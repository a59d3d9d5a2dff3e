// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>

#include "core/scene/paint.h"

namespace qdmd::scene {
namespace {

constexpr double kSlant = 0.15;  // pixels to the left for each pixel down

class Rain : public Effect {
 public:
  Rain(Values values, const StreamSource& streams)
      : density_(values[0]), length_(values[1]), brightness_(values[2]), streams_(streams) {}

  void air(FrameState& state) override {
    Picture& picture = state.picture;
    Stream stream = streams_.at(state.index);
    const double area = static_cast<double>(state.width) * state.height / 1000;
    const auto drops = static_cast<int64_t>(area * density_ + stream.uniform());
    const int length = std::max(1, static_cast<int>(std::lround(length_ * state.height)));
    for (int64_t i = 0; i < drops; ++i) {
      const double x = stream.uniform() * state.width;
      const double top = stream.uniform() * (state.height + length) - length;
      const double bright = brightness_ * stream.uniform(0.4, 1);
      repeat_over_canvas(state, x, top, state.width, state.height + length, length,
                         [&](double left, double upper) {
                           paint(left, static_cast<int>(std::floor(upper)), length, bright,
                                 &picture);
                         });
    }
  }

 private:
  static void paint(double x, int top, int length, double bright, Picture* picture) {
    for (int k = 0; k < length; ++k) {
      const int column = static_cast<int>(std::floor(x - kSlant * k)), row = top + k;
      if (row < 0 || row >= picture->height || column < 0 || column >= picture->width) continue;
      uint8_t* pixel = picture->at(column, row);
      for (int c = 0; c < 3; ++c) pixel[c] = to_level(pixel[c] + bright);
    }
  }

  double density_, length_, brightness_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"density", "drops per 1000 px", 1, 0, 100, "streaks in a frame"},
    {"length", "of the height", 0.06, 0.001, 1, "how far a drop falls while the shutter is open"},
    {"brightness", "levels", 45, 0, 255, "how much lighter a drop is than what it hides"},
};

}  // namespace

const EffectInfo kRain = {
    "rain",      "rain between the objects and the camera: bright streaks, others in every frame",
    kAir,        kRandom,
    kParameters, make_effect<Rain>};

}  // namespace qdmd::scene
