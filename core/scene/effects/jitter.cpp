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
      : amplitude_(values[0] * std::sqrt(2.0 / kWaves)) {
    Stream stream = streams.at(StreamSource::kSetup);
    const double part = std::atan(kHighest);
    const double f0 = values[1] / std::tan(part / 2);
    for (auto& axis : waves_)
      for (int i = 0; i < kWaves; ++i) {
        const double share = (i + stream.uniform()) / kWaves;
        axis[static_cast<size_t>(i)] = {2 * std::numbers::pi * f0 * std::tan(share * part),
                                        2 * std::numbers::pi * stream.uniform()};
      }
  }

  // The waves' crests may meet.
  int margin() const override {
    return amplitude_ > 0 ? static_cast<int>(std::ceil(amplitude_ * kWaves)) + 1 : 0;
  }

  void lens(FrameState& state) override {
    state.shift_x += shift(waves_[0], state.time);
    state.shift_y += shift(waves_[1], state.time);
  }

 private:
  struct Wave {
    double angular_frequency, phase;
  };
  using Axis = std::array<Wave, kWaves>;

  double shift(const Axis& axis, double time) const {
    double sum = 0;
    for (const Wave& wave : axis) sum += std::sin(wave.angular_frequency * time + wave.phase);
    return amplitude_ * sum;
  }

  double amplitude_;
  std::array<Axis, 2> waves_{};
};

constexpr Parameter kParameters[] = {
    {"deviation", "px", 1.5, 0, 20, "standard deviation in x, and in y"},
    {"frequency", "Hz", 3, 0.01, 1000, "below which half of the power lies"},
};

}  // namespace

const EffectInfo kJitter = {
    "jitter",    "a shaking camera: it looks beside its place by fractions of pixels",
    kLens,       kRandom | kWarp | kBuffers,
    kParameters, make_effect<Jitter>};

}  // namespace qdmd::scene
