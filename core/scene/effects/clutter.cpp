// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>

namespace qdmd::scene {
namespace {

constexpr int kLorries = 5;
constexpr double kTop = 0.45, kBottom = 0.90;  // of the frame's height
constexpr double kWidth = 0.35;                // of a lorry, in widths of the frame

// Slots of equal length move along, with one lorry in each, anywhere in its slot: a pixel is
// covered for the lorry's share of the slot.
class Traffic : public Actor {
 public:
  Traffic(const Plan& plan, double share, double speed, const StreamSource& streams)
      : streams_(streams),
        frame_width_(plan.width),
        margin_(plan.backdrop->margin()),
        speed_(speed * plan.width) {
    top_ = static_cast<int>(std::lround(kTop * plan.height));
    const int height = std::max(1, static_cast<int>(std::lround(kBottom * plan.height)) - top_);
    const int width = std::max(1, static_cast<int>(std::lround(kWidth * plan.width)));
    slot_ = width / share;
    Stream stream = streams.at(StreamSource::kSetup);
    for (int i = 0; i < kLorries; ++i) {
      const Colour paint = {to_level(stream.uniform(30, 230)), to_level(stream.uniform(30, 230)),
                            to_level(stream.uniform(30, 230))};
      Sprite lorry = draw_lorry(width, height, paint);
      lorries_.push_back(plan.dress ? plan.dress(lorry, {0, top_, plan.width, height})
                                    : std::move(lorry));
    }
  }

  void place(double time, std::vector<Placement>* placements) const override {
    // Slot i begins at i slot_ + way.
    const double way = time * speed_;
    const auto first = static_cast<int64_t>(std::floor((-way - margin_) / slot_)) - 1;
    for (int64_t i = first;; ++i) {
      const double begin = static_cast<double>(i) * slot_ + way;
      if (begin >= frame_width_ + margin_) break;
      Stream stream = streams_.unlogged(i);
      const Sprite& lorry = lorries_[static_cast<size_t>(stream.index(kLorries))];
      const double x = begin + stream.uniform() * (slot_ - lorry.width());
      if (x < -margin_ - lorry.width() || x > frame_width_ + margin_) continue;
      placements->push_back({&lorry, static_cast<int>(std::floor(x)), top_, false, i});
    }
  }

 private:
  StreamSource streams_;
  int frame_width_, margin_, top_;
  double speed_, slot_;
  std::vector<Sprite> lorries_;
};

class Clutter : public Effect {
 public:
  Clutter(Values values, const StreamSource& streams)
      : share_(values[0]), speed_(values[1]), streams_(streams) {}

  void plan(Plan& plan) override {
    if (share_ > 0)
      plan.actors.push_back(std::make_unique<Traffic>(plan, share_, speed_, streams_));
  }

 private:
  double share_, speed_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"share", "of the time", 0.6, 0, 0.95, "how long a pixel is covered"},
    {"speed", "widths/s", 0.25, 0.001, 100, "how fast the lorries go"},
};

}  // namespace

const EffectInfo kClutter = {
    "clutter",
    "dense traffic: lorries cover every pixel of the rows from 45 to 90 % of "
    "the height for a given share of the time",
    0,
    kRandom | kBuffers,
    kParameters,
    make_effect<Clutter>};

}  // namespace qdmd::scene
