// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/stander.h"

#include <cmath>

namespace qdmd::scene {
namespace {

constexpr double kSpeed = 0.2;                       // frame widths per second
constexpr double kSmallest = 0.22, kTallest = 0.36;  // persons, shares of the frame's height
constexpr double kFarFeet = 0.60, kNearFeet = 0.96;  // where feet are, shares of the height
constexpr int kPlaces = 40;                          // places to choose from

class Stander : public Actor {
 public:
  Stander(Person person, int x, int y, int width, bool forward, const Standing& standing)
      : person_(std::move(person)),
        x_(x),
        y_(y),
        width_(width),
        forward_(forward),
        standing_(standing) {}

  void place(double time, std::vector<Placement>* placements) const override {
    const bool stands = time >= standing_.from && time < standing_.until;
    const double walked =
        stands
            ? 0
            : kSpeed * width_ * (time - (time < standing_.from ? standing_.from : standing_.until));
    const double x = x_ + (forward_ ? walked : -walked);
    if (x + person_.width() < -kBeyond * width_ || x > (1 + kBeyond) * width_) return;
    placements->push_back({&person_.at(walked, forward_), static_cast<int>(std::lround(x)), y_,
                           stands && standing_.part_of_background});
  }

 private:
  Person person_;
  int x_, y_, width_;
  bool forward_;
  Standing standing_;
};

// Where a person might stand.
struct Place {
  Box box;
  double contrast;
};

bool is_free(const Box& box, const std::vector<Box>& taken) {
  return std::none_of(taken.begin(), taken.end(),
                      [&](const Box& other) { return !intersection(box, other).empty(); });
}

}  // namespace

void add_standers(int persons, double busy, const Standing& standing, Stream& stream, Plan* plan) {
  std::vector<Box> taken;
  for (int i = 0; i < persons; ++i) {
    const int height = person_height(
        plan->width,
        static_cast<int>(std::lround(stream.uniform(kSmallest, kTallest) * plan->height)));
    const bool forward = stream.index(2) == 0, before_edges = i < std::lround(busy * persons);
    Person person(height, stream, {}, {});
    Place best{{}, 0};
    bool found = false;
    for (int k = 0; k < kPlaces; ++k) {
      const auto x = static_cast<int>(stream.uniform() * std::max(plan->width - person.width(), 0));
      const auto feet = static_cast<int>(stream.uniform(kFarFeet, kNearFeet) * plan->height);
      const Box box{x, std::max(0, feet - height), person.width(), height};
      const double contrast = plan->backdrop->contrast(box);
      const bool better =
          best.box.empty() || (before_edges ? contrast > best.contrast : contrast < best.contrast);
      const bool free = is_free(box, taken);
      if ((free && !found) || (free == found && better)) best = {box, contrast};
      found |= free;
    }
    taken.push_back(best.box);
    plan->actors.push_back(std::make_unique<Stander>(std::move(person), best.box.x, best.box.y,
                                                     plan->width, forward, standing));
  }
}

}  // namespace qdmd::scene
