// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"
#include "core/scene/effects/sensor_noise.h"
#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

class LostSignal : public Effect {
 public:
  LostSignal(Values values, const StreamSource& streams)
      : level_(to_level(values[0])),
        noise_({values[1], 0, 1}),
        times_(values.last(3)),
        streams_(streams) {}

  void sensor(FrameState& state) override {
    if (!times_.on(state.time)) return;
    state.picture.fill(level_);
    Stream stream = streams_.at(state.index);
    noise_.add(stream, &state.picture);
  }

 private:
  uint8_t level_;
  SensorNoise noise_;
  Times times_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"level", "levels", 128, 0, 255, "grey that is seen instead; 16: black", true},
    {"deviation", "levels", 2, 0, 60, "standard deviation of the receiver's noise"},
    Times::kFrom,
    Times::kSeconds,
    Times::kEvery,
};

}  // namespace

const EffectInfo kLostSignal = {
    "lost-signal",
    "disturbance: the camera's signal is lost, and frames are flat; the truth goes on",
    kSensor,
    kRandom | kBuffers,
    kParameters,
    make_effect<LostSignal>};

}  // namespace qdmd::scene
