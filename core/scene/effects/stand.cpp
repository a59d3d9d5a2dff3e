// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"
#include "core/scene/effects/stander.h"

namespace qdmd::scene {
namespace {

class Stand : public Effect {
 public:
  Stand(Values values, const StreamSource& streams)
      : persons_(static_cast<int>(values[0])),
        busy_(values[1]),
        standing_{values[2], values[2] + values[3], false},
        streams_(streams) {}

  void plan(Plan& plan) override {
    Stream stream = streams_.at(StreamSource::kSetup);
    add_standers(persons_, busy_, standing_, stream, &plan);
  }

 private:
  int persons_;
  double busy_;
  Standing standing_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"persons", "", 4, 1, 50, "how many", true},
    {"busy", "of the persons", 0.5, 0, 1,
     "who stand before places of much contrast, the others before plain ones"},
    {"from", "s", 4, 0, 36000, "when they have come"},
    {"seconds", "s", 36000, 0, 36000, "how long they stand"},
};

}  // namespace

const EffectInfo kStand = {
    "stand",
    "intermittent motion: persons walk to places that were empty and stand there; they are "
    "foreground as long as they are there",
    0,
    kRandom | kBuffers,
    kParameters,
    make_effect<Stand>};

}  // namespace qdmd::scene
