// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"
#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

class Smear : public Effect {
 public:
  Smear(Values values, const StreamSource&) : top_(values[0]), times_(values.last(3)) {}

  void sensor(FrameState& state) override {
    if (!times_.on(state.time)) return;
    Picture& picture = state.picture;
    const int whole = std::max(1, static_cast<int>(top_ * picture.height));
    for (int y = whole; y < picture.height; ++y)
      std::copy_n(picture.row(whole - 1), picture.row_bytes(), picture.row(y));
  }

 private:
  double top_;
  Times times_;
};

constexpr Parameter kParameters[] = {
    {"top", "of the height", 0.33, 0, 1, "rows that are whole"},
    Times::kFrom,
    Times::kSeconds,
    Times::kEvery,
};

}  // namespace

const EffectInfo kSmear = {
    "smear",
    "disturbance: a slice of the frame is lost, and the last whole row is seen in all below it; "
    "the truth goes on",
    kSensor,
    0,
    kParameters,
    make_effect<Smear>};

}  // namespace qdmd::scene
