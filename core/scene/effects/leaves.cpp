// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <numbers>

namespace qdmd::scene {
namespace {

constexpr int kTwigs = 64;

class Leaves : public Effect {
 public:
  Leaves(Values values, const StreamSource& streams)
      : amplitude_(values[0]), frequency_(values[1]), streams_(streams) {}

  void plan(Plan& plan) override {
    backdrop_ = plan.backdrop;
    Stream stream = streams_.at(StreamSource::kSetup);
    for (Twig& twig : twigs_)
      twig = {2 * std::numbers::pi * stream.uniform(), 2 * std::numbers::pi * stream.uniform(),
              frequency_ * stream.uniform(0.6, 1.4)};
  }

  void world(FrameState& state) override {
    const Box& box = backdrop_->tree_crown();
    const Picture& still = backdrop_->picture();
    for (size_t i = 0; i < twigs_.size(); ++i) {
      const double turn = 2 * std::numbers::pi * twigs_[i].frequency * state.time;
      moved_[i] = {
          static_cast<int>(std::lround(amplitude_ * std::sin(turn + twigs_[i].phase_x))),
          static_cast<int>(std::lround(amplitude_ / 2 * std::sin(turn + twigs_[i].phase_y)))};
    }
    const int side = std::max(2, box.width / 12);
    for (int y = box.y; y < box.bottom(); ++y)
      for (int x = box.x; x < box.right(); ++x) {
        const double u = (x + 0.5 - box.x) / box.width * 2 - 1;
        const double v = (y + 0.5 - box.y) / box.height * 2 - 1;
        if (u * u + v * v >= 1) continue;
        const auto twig =
            static_cast<size_t>(((x - box.x) / side + (y - box.y) / side * 7) % kTwigs);
        const int from_x = std::clamp(x + moved_[twig][0], box.x, box.right() - 1);
        const int from_y = std::clamp(y + moved_[twig][1], box.y, box.bottom() - 1);
        std::copy_n(still.at(from_x, from_y), 3, state.world.at(x, y));
      }
  }

 private:
  struct Twig {
    double phase_x, phase_y, frequency;
  };

  double amplitude_, frequency_;
  StreamSource streams_;
  const Backdrop* backdrop_ = nullptr;
  std::array<Twig, kTwigs> twigs_{};
  std::array<std::array<int, 2>, kTwigs> moved_{};
};

constexpr Parameter kParameters[] = {
    {"amplitude", "px", 2, 0, 50, "how far a leaf moves from its place"},
    {"frequency", "Hz", 0.8, 0.01, 20, "of the wind"},
};

}  // namespace

const EffectInfo kLeaves = {
    "leaves",
    "moving background: the tree's leaves wave in the wind; waving leaves are background",
    kWorld,
    kRandom | kBuffers,
    kParameters,
    make_effect<Leaves>};

}  // namespace qdmd::scene
