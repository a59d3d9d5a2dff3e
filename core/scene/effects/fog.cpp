// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <numbers>

#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

constexpr double kFogLevel = 190;

class Fog : public Effect {
 public:
  Fog(Values values, const StreamSource&) : density_(values[0]), times_(values.last(3)) {}

  void air(FrameState& state) override {
    const std::optional<double> since = times_.since(state.time);
    if (!since) return;
    const double wave = std::sin(std::numbers::pi * *since / times_.seconds());
    const double hidden = density_ * wave * wave;
    std::array<uint8_t, 256> seen;
    for (size_t level = 0; level < seen.size(); ++level)
      seen[level] = to_level(static_cast<double>(level) * (1 - hidden) + kFogLevel * hidden);
    for (uint8_t& sample : state.picture.samples) sample = seen[sample];
  }

 private:
  double density_;
  Times times_;
};

constexpr Parameter kParameters[] = {
    {"density", "of the light", 0.7, 0, 1, "what it hides at its thickest"},
    Times::kFrom,
    {"seconds", "s", 8, 0, 1e6, "how long it takes to come and go"},
    Times::kEvery,
};

}  // namespace

const EffectInfo kFog = {
    "fog",       "disturbance: fog comes, hides everything a little, and goes; the truth has none",
    kAir,        0,
    kParameters, make_effect<Fog>};

}  // namespace qdmd::scene
