// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"
#include "core/scene/effects/stander.h"

namespace qdmd::scene {
namespace {

class Leave : public Effect {
 public:
  Leave(Values values, const StreamSource& streams)
      : persons_(static_cast<int>(values[0])),
        busy_(values[1]),
        standing_{0, values[2], true},
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
    {"at", "s", 4, 0, 36000, "when they leave"},
};

}  // namespace

const EffectInfo kLeave = {
    "leave",
    "intermittent motion: persons who stand there from the first frame, and belong to the "
    "background, walk away; they are foreground while they walk",
    0,
    kRandom | kBuffers,
    kParameters,
    make_effect<Leave>};

}  // namespace qdmd::scene
