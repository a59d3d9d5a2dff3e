// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

class Bag : public Actor {
 public:
  Bag(Sprite sprite, int x, int y, double from, double until)
      : sprite_(std::move(sprite)), x_(x), y_(y), from_(from), until_(until) {}

  void place(double time, std::vector<Placement>* placements) const override {
    if (time >= from_ && time < until_) placements->push_back({&sprite_, x_, y_});
  }

 private:
  Sprite sprite_;
  int x_, y_;
  double from_, until_;
};

class Abandon : public Effect {
 public:
  Abandon(Values values, const StreamSource& streams)
      : from_(values[0]), seconds_(values[1]), streams_(streams) {}

  void plan(Plan& plan) override {
    Stream stream = streams_.at(StreamSource::kSetup);
    const Colour leather = {to_level(stream.uniform(110, 200)), to_level(stream.uniform(20, 80)),
                            to_level(stream.uniform(10, 60))};
    const int height = std::max(1, plan.height / 8);
    Sprite bag = draw_bag(height, leather);
    const auto x = static_cast<int>(stream.uniform(0.35, 0.55) * plan.width);
    const int y = static_cast<int>(0.74 * plan.height) - height;
    if (plan.dress) bag = plan.dress(bag, {x, y, bag.width(), height});
    plan.actors.push_back(std::make_unique<Bag>(std::move(bag), x, y, from_, from_ + seconds_));
  }

 private:
  double from_, seconds_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"from", "s", 2.5, 0, 36000, "when it is put down"},
    {"seconds", "s", 15, 0, 36000, "how long it lies there"},
};

}  // namespace

const EffectInfo kAbandon = {"abandon",
                             "intermittent motion: a bag is left on the pavement and taken away "
                             "later; it is foreground as long as it is there",
                             0,
                             kRandom | kBuffers,
                             kParameters,
                             make_effect<Abandon>};

}  // namespace qdmd::scene
