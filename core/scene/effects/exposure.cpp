#include "core/scene/effects/infos.h"

#include <cmath>

namespace qdmd::scene {
namespace {

// The lag's exponential weights, cut off where 0.7 % are left.
constexpr int kSteps = 50;
constexpr double kReach = 5;

class Exposure : public Effect {
 public:
  Exposure(Values values, const StreamSource&) : strength_(values[0]), lag_(values[1]) {
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
      sum += weights_[static_cast<size_t>(i)] = std::exp(-step() * i);
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
      level += weights_[static_cast<size_t>(i)] * metered_(std::max(0.0, time - step() * lag_ * i));
    light->scale(std::pow(target_ / std::max(level, 1.0), strength_));
  }

 private:
  static double step() { return kReach / kSteps; }

  double strength_, lag_;
  double target_ = 128;
  std::array<double, kSteps> weights_{};
  std::function<double(double)> metered_;
};

constexpr Parameter kParameters[] = {
    {"strength", "of the change", 0.8, 0, 1,
     "what the camera takes back of a change of the mean level in the end"},
    {"lag", "s", 1, 0.01, 60, "time constant"},
};

}  // namespace

const EffectInfo kExposure = {
    "exposure",  "automatic exposure: the camera's gain follows the mean level, with a lag",
    kMeter,      kBuffers,
    kParameters, make_effect<Exposure>};

}  // namespace qdmd::scene
