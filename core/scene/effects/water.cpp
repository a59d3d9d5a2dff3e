// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <numbers>

namespace qdmd::scene {
namespace {

constexpr int kWaves = 5;
constexpr double kGlitter = 0.15;  // change of the level on a slope of one

class Water : public Effect {
 public:
  Water(Values values, const StreamSource& streams)
      : amplitude_(values[0]), frequency_(values[1]), streams_(streams) {}

  // Waves show what is beside the frame.
  int margin(int, int) const override { return static_cast<int>(std::ceil(2 * amplitude_)); }

  void plan(Plan& plan) override {
    backdrop_ = plan.backdrop;
    Stream stream = streams_.at(StreamSource::kSetup);
    const double length = std::max(plan.height, 8);
    for (Wave& wave : waves_) {
      const double turns = stream.uniform(6, 18);
      wave = {2 * std::numbers::pi * turns / length * stream.uniform(0.1, 0.5),
              2 * std::numbers::pi * turns / length, frequency_ * stream.uniform(0.6, 1.6),
              2 * std::numbers::pi * stream.uniform()};
    }
  }

  void world(FrameState& state) override {
    const Box& box = backdrop_->canal();
    const Picture& still = backdrop_->picture();
    for (int y = box.y; y < box.bottom(); ++y)
      for (int x = box.x; x < box.right(); ++x) {
        double height = 0, slope = 0;
        for (const Wave& wave : waves_) {
          const double phase = wave.x * (x - state.margin) + wave.y * (y - state.margin) -
                               2 * std::numbers::pi * wave.frequency * state.time + wave.phase;
          height += std::sin(phase) / kWaves;
          slope += std::cos(phase) / kWaves;
        }
        const int from = std::clamp(x + static_cast<int>(std::lround(2 * amplitude_ * height)),
                                    box.x, box.right() - 1);
        const double bright = 1 + kGlitter * slope;
        for (int c = 0; c < 3; ++c)
          state.world.at(x, y)[c] = to_level(still.at(from, y)[c] * bright);
      }
  }

 private:
  struct Wave {
    double x, y;       // radians per pixel
    double frequency;  // Hz
    double phase;
  };

  double amplitude_, frequency_;
  StreamSource streams_;
  const Backdrop* backdrop_ = nullptr;
  std::array<Wave, kWaves> waves_{};
};

constexpr Parameter kParameters[] = {
    {"amplitude", "px", 3, 0, 50, "how far waves bend what is seen"},
    {"frequency", "Hz", 0.5, 0.01, 20, "of the waves"},
};

}  // namespace

const EffectInfo kWater = {
    "water",     "moving background: waves on the canal; they are background",
    kWorld,      kRandom | kWarp | kBuffers,
    kParameters, make_effect<Water>};

}  // namespace qdmd::scene
