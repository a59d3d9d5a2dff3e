// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <numbers>

namespace qdmd::scene {
namespace {

// The past's weights, cut off where 0.7 % are left.
constexpr int kSteps = 50;
constexpr double kReach = 5;

class Exposure : public Effect {
 public:
  Exposure(Values values, const StreamSource&)
      : strength_(values[0]),
        lag_(values[1]),
        delay_(values[2]),
        brightness_(values[4]),
        gamma_(values[5]),
        swing_(values[6]),
        period_(values[7]) {
    // A camera that overshoots is a swing that is damped: what it has taken in of a step at time t,
    // in lags, is 1 - e^-t (cos wt + sin wt / w), whose first peak is e^(-pi / w) too high.
    const double overshoot = values[3];
    const double turns =
        overshoot > 0 ? std::numbers::pi / -std::log(overshoot) : 0;  // w, in radians a lag
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double past = step() * i;
      sum += weights_[static_cast<size_t>(i)] =
          std::exp(-past) * (overshoot > 0 ? std::sin(turns * past) : 1);
    }
    for (auto& weight : weights_) weight /= sum;
  }

  void plan(Plan& plan) override {
    metered_ = plan.metered;
    // Set for daylight and an empty street.
    const auto mean = plan.backdrop->mean({});
    target_ = (mean[0] + mean[1] + mean[2]) / 3;
  }

  // From the light of the past alone, so that every frame can be asked for first.
  void meter(double time, Light* light) const override {
    double level = 0;
    for (int i = 0; i < kSteps; ++i)
      level += weights_[static_cast<size_t>(i)] *
               metered_(std::max(0.0, time - delay_ - step() * lag_ * i));
    light->scale(std::pow(target_ / std::max(level, 1.0), strength_));
    light->scale(brightness_ * (1 + swing_ * std::sin(2 * std::numbers::pi * time / period_)));
    light->gamma = gamma_;
  }

 private:
  static double step() { return kReach / kSteps; }

  double strength_, lag_, delay_, brightness_, gamma_, swing_, period_;
  double target_ = 128;
  std::array<double, kSteps> weights_{};
  std::function<double(double)> metered_;
};

constexpr Parameter kParameters[] = {
    {"strength", "of the change", 0.8, 0, 1,
     "what the camera takes back of a change of the mean level in the end"},
    {"lag", "s", 1, 0.01, 60, "time constant"},
    {"delay", "s", 0, 0, 60, "after which it begins to follow"},
    {"overshoot", "of the change", 0, 0, 0.4, "by which it goes too far at first"},
    {"brightness", "of the light", 1, 0.05, 20,
     "exposure by day; what is then brighter than white is clipped"},
    {"gamma", "", 1, 1, 4, "exponent of the curve behind which the camera exposes; 2.4: sRGB's"},
    {"swing", "of the light", 0, 0, 0.9, "by which the exposure hunts to either side"},
    {"period", "s", 4, 0.01, 1e6, "in which it does that once"},
};

}  // namespace

const EffectInfo kExposure = {
    "exposure",  "automatic exposure: the camera's gain follows the mean level, with a lag",
    kMeter,      kBuffers,
    kParameters, make_effect<Exposure>};

}  // namespace qdmd::scene
