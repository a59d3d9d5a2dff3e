// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <numbers>

namespace qdmd::scene {
namespace {

// So many sine waves of equal power for each axis. Their frequencies are the quantiles of the
// distribution whose density is proportional to 1 / (f^2 + f0^2), that of a damped random motion,
// cut off at kHighest f0; each is drawn within its own share of the power.
constexpr int kWaves = 24;
constexpr double kHighest = 8;

class Jitter : public Effect {
 public:
  Jitter(Values values, const StreamSource& streams)
      : amplitude_(values[0] * std::sqrt(2.0 / kWaves)),
        turn_(values[2] * std::numbers::pi / 180 * std::sqrt(2.0 / kWaves)),
        drift_(values[3]),
        way_(values[4]) {
    Stream stream = streams.at(StreamSource::kSetup);
    const double part = std::atan(kHighest);
    const double f0 = values[1] / std::tan(part / 2);
    for (auto& axis : waves_) {
      // Nothing is drawn for what does not turn.
      if (&axis == &waves_[2] && turn_ == 0) continue;
      for (int i = 0; i < kWaves; ++i) {
        const double share = (i + stream.uniform()) / kWaves;
        axis[static_cast<size_t>(i)] = {2 * std::numbers::pi * f0 * std::tan(share * part),
                                        2 * std::numbers::pi * stream.uniform()};
      }
    }
  }

  // The waves' crests may meet.
  int margin(int width, int height) const override {
    double pixels =
        amplitude_ * kWaves + std::min(turn_ * kWaves, 1.0) * std::hypot(width, height) / 2;
    if (drift_ != 0) pixels += way_;
    return pixels > 0 ? static_cast<int>(std::ceil(pixels)) + 1 : 0;
  }

  void lens(FrameState& state) override {
    const double drift = std::clamp(drift_ * state.time, -way_, way_);
    state.shift_x += amplitude_ * sum(waves_[0], state.time) + drift;
    state.shift_y += amplitude_ * sum(waves_[1], state.time) + drift;
    if (turn_ > 0) state.turn += turn_ * sum(waves_[2], state.time);
  }

 private:
  struct Wave {
    double angular_frequency, phase;
  };
  using Axis = std::array<Wave, kWaves>;

  static double sum(const Axis& axis, double time) {
    double sum = 0;
    for (const Wave& wave : axis) sum += std::sin(wave.angular_frequency * time + wave.phase);
    return sum;
  }

  double amplitude_, turn_, drift_, way_;
  std::array<Axis, 3> waves_{};  // to the right, down, and around
};

constexpr Parameter kParameters[] = {
    {"deviation", "px", 1.5, 0, 20, "standard deviation in x, and in y"},
    {"frequency", "Hz", 3, 0.01, 1000, "below which half of the power lies"},
    {"rotation", "degrees", 0, 0, 5, "standard deviation of its turn around the picture's middle"},
    {"drift", "px/s", 0, -100, 100,
     "by which it looks further to the right, and down, all the time"},
    {"way", "px", 40, 0, 1000, "after which the drift ends"},
};

}  // namespace

const EffectInfo kJitter = {
    "jitter",    "a shaking camera: it looks beside its place, turns, and drifts away",
    kLens,       kRandom | kWarp | kBuffers,
    kParameters, make_effect<Jitter>};

}  // namespace qdmd::scene
