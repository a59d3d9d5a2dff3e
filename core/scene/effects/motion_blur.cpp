// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

constexpr int kSamples = 8;

// Adds up what the shutter sees at some times.
class Accumulator {
 public:
  void add(const std::vector<uint8_t>& samples, bool first) {
    sums_.resize(samples.size());
    for (size_t i = 0; i < samples.size(); ++i)
      sums_[i] = static_cast<uint16_t>((first ? 0 : sums_[i]) + samples[i]);
  }
  // The mean of kSamples, rounded to the nearest, or up.
  void mean(int round, std::vector<uint8_t>* samples) const {
    for (size_t i = 0; i < sums_.size(); ++i)
      (*samples)[i] = static_cast<uint8_t>((sums_[i] + round) / kSamples);
  }

 private:
  std::vector<uint16_t> sums_;
};

class MotionBlur : public Effect {
 public:
  MotionBlur(Values values, const StreamSource&) : exposure_(values[0]) {}

  void expose(FrameState& state, const PaintObjects& paint) override {
    for (int i = 0; i < kSamples; ++i) {
      const double offset = ((i + 0.5) / kSamples - 0.5) * exposure_ * state.interval;
      paint(std::max(0.0, state.time + offset));
      if (state.wants(kFrame)) picture_.add(state.picture.samples, i == 0);
      if (!state.wants(kLabels)) continue;
      coverage_.add(state.coverage.samples, i == 0);
      if (!state.shadow.samples.empty()) shadow_.add(state.shadow.samples, i == 0);
    }
    if (state.wants(kFrame)) picture_.mean(kSamples / 2, &state.picture.samples);
    if (!state.wants(kLabels)) return;
    coverage_.mean(kSamples - 1, &state.coverage.samples);
    if (!state.shadow.samples.empty()) shadow_.mean(kSamples - 1, &state.shadow.samples);
  }

 private:
  double exposure_;
  Accumulator picture_, coverage_, shadow_;
};

constexpr Parameter kParameters[] = {
    {"exposure", "of the frame interval", 0.5, 0, 1,
     "how long the shutter is open, around the time of the frame"},
};

}  // namespace

const EffectInfo kMotionBlur = {
    "motion-blur", "a slow shutter: moving objects are blurred along their way",
    kExpose,       kBuffers,
    kParameters,   make_effect<MotionBlur>};

}  // namespace qdmd::scene
