// SPDX-License-Identifier: LGPL-2.1-or-later
#include <cmath>
#include <numbers>

#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

constexpr int kWaves = 16;
// Rows, as shares of the height: where the lake begins, and, above it, waves without end.
constexpr double kShore = 0.5, kHorizon = 0.25;
// The lens's focal length in heights of the frame, and metres of water along one of them at its
// lower edge.
constexpr double kFocal = 1.2, kMetres = 5;
// The boat: its length in widths of the frame, its height and how far it bobs in heights, and the
// seconds between two crossings.
constexpr double kLength = 0.4, kHeight = 0.12, kBob = 0.004, kPause = 5;

// Crosses the lake to and fro.
class Boat : public Actor {
 public:
  Boat(const Plan& plan, double from, double seconds, Stream& stream)
      : width_(plan.width), bob_(kBob * plan.height), from_(from), seconds_(seconds) {
    std::vector<Colour> coats(3);
    for (Colour& coat : coats)
      coat = {to_level(stream.uniform(25, 200)), to_level(stream.uniform(25, 200)),
              to_level(stream.uniform(25, 200))};
    const uint8_t dark = to_level(stream.uniform(30, 55));
    const int length = static_cast<int>(std::lround(kLength * plan.width)),
              height = std::max(1, static_cast<int>(std::lround(kHeight * plan.height)));
    forward_ = draw_boat(length, height, {dark, dark, to_level(dark + 6.0)}, coats);
    backward_ = mirrored(forward_);
    top_ = stream.uniform(0.7, 0.85) * plan.height - height;
  }

  void place(double time, std::vector<Placement>* placements) const override {
    if (time < from_) return;
    const double period = seconds_ + kPause, pass = std::floor((time - from_) / period);
    const double way = (time - from_ - pass * period) / seconds_ *
                       (width_ + forward_.width() + 2 * kBeyond * width_);
    const bool forward = static_cast<int64_t>(pass) % 2 == 0;
    const double beyond = kBeyond * width_;
    const double x = forward ? way - forward_.width() - beyond : width_ + beyond - way;
    const double y = top_ + bob_ * std::sin(2 * std::numbers::pi * 0.4 * time);
    placements->push_back({forward ? &forward_ : &backward_, static_cast<int>(std::lround(x)),
                           static_cast<int>(std::lround(y)), false, static_cast<int64_t>(pass)});
  }

 private:
  int width_;
  double bob_, from_, seconds_, top_ = 0;
  Sprite forward_, backward_;
};

class Lake : public Effect {
 public:
  Lake(Values values, const StreamSource& streams)
      : seconds_(values[0]), from_(values[1]), glitter_(values[2]), streams_(streams) {}

  void plan(Plan& plan) override {
    plan.crossed = false;
    Stream stream = streams_.at(StreamSource::kSetup);
    for (Wave& wave : waves_) {
      const double metres = 0.15 * std::pow(8, stream.uniform());
      const double turn = stream.uniform(-1, 1);
      const double number = 2 * std::numbers::pi / metres;
      // Waves on deep water.
      wave = {number * std::sin(turn), number * std::cos(turn), std::sqrt(9.81 * number),
              2 * std::numbers::pi * stream.uniform()};
    }
    colour_ =
        plan.backdrop->mean({0, static_cast<int>(kCanal * plan.height), plan.width, plan.height});
    plan.actors.push_back(std::make_unique<Boat>(plan, from_, seconds_, stream));
  }

  void world(FrameState& state) override {
    const double horizon = kHorizon * state.height;
    for (int y = static_cast<int>(kShore * state.height) + state.margin; y < state.world.height;
         ++y) {
      // Metres of water behind the lens, from row to row, and from column to column.
      const double below = y - state.margin + 0.5 - horizon;
      const double column = kMetres * (1 - kHorizon) / below;
      const double distance = kFocal * state.height * column, row = distance / below;
      std::array<double, kWaves> seen{};
      for (size_t i = 0; i < waves_.size(); ++i) {
        // A pixel shows the mean of waves that are smaller.
        const double along = waves_[i].y * row / std::numbers::pi;
        seen[i] = std::exp(-along * along);
      }
      for (int x = 0; x < state.world.width; ++x) {
        const double across = (x - state.margin + 0.5 - state.width / 2.0) * column;
        double slope = 0;
        for (size_t i = 0; i < waves_.size(); ++i)
          slope += seen[i] * std::cos(waves_[i].x * across + waves_[i].y * distance -
                                      waves_[i].speed * state.time + waves_[i].phase);
        slope *= std::sqrt(2.0 / kWaves);
        // Steep ones mirror the sun.
        const double bright = 1 + glitter_ * (slope + std::max(0.0, slope - 1));
        for (size_t c = 0; c < 3; ++c)
          state.world.at(x, y)[c] = to_level(std::clamp(colour_[c] * bright, 16.0, 235.0));
      }
    }
  }

 private:
  struct Wave {
    double x, y;   // radians per metre
    double speed;  // radians per second
    double phase;
  };

  double seconds_, from_, glitter_;
  StreamSource streams_;
  std::array<double, 3> colour_{};
  std::array<Wave, kWaves> waves_{};
};

constexpr Parameter kParameters[] = {
    {"seconds", "s", 7, 0.1, 36000, "how long it takes to cross"},
    {"from", "s", 5, 0, 36000, "when it comes first"},
    {"glitter", "of the light", 0.25, 0, 2, "standard deviation of the water's brightness"},
};

}  // namespace

const EffectInfo kBoat = {"boat",
                          "moving background: a slow, flat boat with people crosses a lake that "
                          "glitters, in place of persons; the lake is background",
                          kWorld,
                          kRandom | kBuffers,
                          kParameters,
                          make_effect<Lake>};

}  // namespace qdmd::scene
