// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>

namespace qdmd::scene {
namespace {

constexpr double kAcceleration = 0.12;  // frame widths per square second

class ParkedVan : public Actor {
 public:
  ParkedVan(Sprite sprite, int x, int y, int width, double at)
      : sprite_(std::move(sprite)), x_(x), y_(y), width_(width), at_(at) {}

  void place(double time, std::vector<Placement>* placements) const override {
    const double driven = std::max(0.0, time - at_);
    const double way = std::min(0.5 * kAcceleration * driven * driven, 3.0) * width_;
    if (x_ + way > (1 + kBeyond) * width_) return;
    placements->push_back({&sprite_, x_ + static_cast<int>(std::lround(way)), y_, time < at_});
  }

 private:
  Sprite sprite_;
  int x_, y_, width_;
  double at_;
};

class Remove : public Effect {
 public:
  Remove(Values values, const StreamSource& streams) : at_(values[0]), streams_(streams) {}

  void plan(Plan& plan) override {
    Stream stream = streams_.at(StreamSource::kSetup);
    const Colour paint = {to_level(stream.uniform(40, 220)), to_level(stream.uniform(40, 220)),
                          to_level(stream.uniform(40, 220))};
    const int width = std::max(1, plan.width * 3 / 10), height = std::max(1, plan.height / 4);
    Sprite van = draw_van(width, height, paint);
    const auto x = static_cast<int>(stream.uniform(0.05, 0.25) * plan.width);
    const int y = static_cast<int>(0.78 * plan.height) - height;
    if (plan.dress) van = plan.dress(van, {x, y, width, height});
    plan.actors.push_back(std::make_unique<ParkedVan>(std::move(van), x, y, plan.width, at_));
  }

 private:
  double at_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"at", "s", 6, 0, 36000, "when it drives off"},
};

}  // namespace

const EffectInfo kRemove = {
    "remove",
    "intermittent motion: a van that stands there from the first frame, and belongs to the "
    "background, drives off; it is foreground while it moves",
    0,
    kRandom | kBuffers,
    kParameters,
    make_effect<Remove>};

}  // namespace qdmd::scene
