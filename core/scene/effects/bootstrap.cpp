// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>

namespace qdmd::scene {
namespace {

class Stroller : public Actor {
 public:
  Stroller(const Plan& plan, Stream& stream)
      : person_(height_in(plan), stream, plan.dress,
                {0, plan.height / 4, plan.width, plan.height * 5 / 8}),
        path_(std::max(plan.width - person_.width(), 0)),
        top_(std::max(
            0, static_cast<int>(stream.uniform(0.66, 0.90) * plan.height) - person_.height())),
        speed_(stream.uniform(0.08, 0.2) * plan.width),
        start_(stream.uniform(0, 2.0 * path_)) {}

  void place(double time, std::vector<Placement>* placements) const override {
    const double way = start_ + time * speed_;
    const double lap = path_ > 0 ? std::fmod(way, 2.0 * path_) : 0;
    const bool forward = lap <= path_;
    placements->push_back({&person_.at(way, forward),
                           static_cast<int>(std::lround(forward ? lap : 2 * path_ - lap)), top_});
  }

 private:
  static int height_in(const Plan& plan) { return person_height(plan.width, plan.height * 2 / 5); }

  Person person_;
  int path_, top_;
  double speed_, start_;
};

class Bootstrap : public Effect {
 public:
  Bootstrap(Values values, const StreamSource& streams)
      : persons_(static_cast<int>(values[0])), streams_(streams) {}

  void plan(Plan& plan) override {
    for (int i = 0; i < persons_; ++i) {
      Stream stream = streams_.at(i);
      plan.actors.push_back(std::make_unique<Stroller>(plan, stream));
    }
  }

 private:
  int persons_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"persons", "", 3, 1, 50, "how many", true},
};

}  // namespace

const EffectInfo kBootstrap = {
    "bootstrap", "no frame without foreground: persons walk to and fro and never leave the frame",
    0,           kRandom | kBuffers,
    kParameters, make_effect<Bootstrap>};

}  // namespace qdmd::scene
