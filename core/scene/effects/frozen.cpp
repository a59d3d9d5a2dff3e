// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>

#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

class Frozen : public Effect {
 public:
  Frozen(Values values, const StreamSource&) : times_(values.last(3)) {}

  void plan(Plan& plan) override { pace_ = plan.pace > 0 ? plan.pace : plan.interval; }

  int64_t arrives(int64_t index) const override {
    const std::optional<double> since = times_.since(static_cast<double>(index) * pace_);
    if (!since) return index;
    // Whole frames; a thousandth forgives the rounding of their times.
    const auto frames = static_cast<int64_t>(std::floor(*since / pace_ + 1e-3));
    return std::max<int64_t>(0, index - frames);
  }

 private:
  Times times_;
  double pace_ = 0;  // seconds of the scene between frames
};

constexpr Parameter kParameters[] = {Times::kFrom, Times::kSeconds, Times::kEvery};

}  // namespace

const EffectInfo kFrozen = {
    "frozen",
    "disturbance: the first frame of a time is seen again and again until its end; the truth goes "
    "on",
    kLink,
    0,
    kParameters,
    make_effect<Frozen>};

}  // namespace qdmd::scene
