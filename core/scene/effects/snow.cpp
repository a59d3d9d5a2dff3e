// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <numbers>

#include "core/scene/paint.h"

namespace qdmd::scene {
namespace {

constexpr Colour kFlake{238, 240, 245};

class Snow : public Effect {
 public:
  Snow(Values values, const StreamSource& streams)
      : density_(values[0]), size_(values[1]), speed_(values[2]), streams_(streams) {}

  // Every flake falls for ever, over and over through the frame; its way follows from its draws.
  void air(FrameState& state) override {
    Stream stream = streams_.at(StreamSource::kSetup);
    const double area = static_cast<double>(state.width) * state.height / 1000;
    const auto flakes = static_cast<int64_t>(std::lround(area * density_));
    for (int64_t i = 0; i < flakes; ++i) {
      const double start_x = stream.uniform(), start_y = stream.uniform();
      const double near = stream.uniform(0.5, 1), phase = stream.uniform();
      const double radius = std::max(0.5, near * size_ * state.height / 2);
      const double fallen = start_y + near * speed_ * state.time;
      const double height = state.height + 2 * radius;
      const double y = (fallen - std::floor(fallen)) * height - radius;
      const double drift = 0.02 * std::sin(2 * std::numbers::pi * (phase + 0.4 * state.time));
      const double across = start_x + drift - std::floor(start_x + drift);
      repeat_over_canvas(state, across * state.width, y, state.width, height, radius,
                         [&](double centre_x, double centre_y) {
                           paint(centre_x, centre_y, radius, &state.picture);
                         });
    }
  }

 private:
  static void paint(double centre_x, double centre_y, double radius, Picture* picture) {
    const int left = std::max(0, static_cast<int>(std::floor(centre_x - radius)));
    const int right = std::min(picture->width, static_cast<int>(std::ceil(centre_x + radius)));
    const int top = std::max(0, static_cast<int>(std::floor(centre_y - radius)));
    const int bottom = std::min(picture->height, static_cast<int>(std::ceil(centre_y + radius)));
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) {
        const double dx = x + 0.5 - centre_x, dy = y + 0.5 - centre_y;
        if (dx * dx + dy * dy <= radius * radius) std::copy_n(kFlake.begin(), 3, picture->at(x, y));
      }
  }

  double density_, size_, speed_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"density", "flakes per 1000 px", 1, 0, 100, "flakes in a frame"},
    {"size", "of the height", 0.012, 0.001, 0.5, "diameter of a flake"},
    {"speed", "heights/s", 0.25, 0, 10, "how fast they fall"},
};

}  // namespace

const EffectInfo kSnow = {
    "snow",      "snow between the objects and the camera: flakes that fall and drift",
    kAir,        kRandom,
    kParameters, make_effect<Snow>};

}  // namespace qdmd::scene
