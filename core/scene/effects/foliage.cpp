// SPDX-License-Identifier: LGPL-2.1-or-later
#include <cmath>
#include <numbers>

#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

// Shapes of leaves, each in some turns; many leaves have the same one.
constexpr int kShapes = 12, kTurns = 7;
// The area of a leaf's outline over that of a square as long as the leaf, and how far it turns to
// each side, in radians.
constexpr double kFilled = 0.42 * 2 / 3, kTurn = 0.2;
constexpr int kMostLeaves = 4000;

using Shape = std::array<Sprite, kTurns>;

struct Leaf {
  double x, y;  // its middle, in pixels, where there is no wind
  size_t shape;
  double amplitude;        // pixels
  double phase[4];         // of its ways right and down, and of its turn
  double frequency[3];     // Hz
  double rests_until = 0;  // seconds
};

// Leaves between the objects and the camera.
class Branches : public Actor {
 public:
  Branches(std::vector<Shape> shapes, std::vector<Leaf> leaves)
      : shapes_(std::move(shapes)), leaves_(std::move(leaves)) {}

  void place(double time, std::vector<Placement>* placements) const override {
    for (const Leaf& leaf : leaves_) {
      const double wind = time < leaf.rests_until ? 0 : 1;
      const auto wave = [&](int way, double speed, int phase) {
        const double turns = speed * leaf.frequency[way] * time;
        return wind * std::sin(2 * std::numbers::pi * turns + leaf.phase[phase]);
      };
      const double x = leaf.x + leaf.amplitude * (0.7 * wave(0, 1, 0) + 0.3 * wave(1, 2.1, 1));
      const double y = leaf.y + leaf.amplitude * 0.5 * wave(1, 1, 2);
      const long turn = std::lround((kTurns - 1) * 0.5 * (1 + wave(2, 1, 3)));
      const Sprite& sprite = shapes_[leaf.shape][static_cast<size_t>(turn)];
      placements->push_back({&sprite, static_cast<int>(std::lround(x - sprite.width() / 2.0)),
                             static_cast<int>(std::lround(y - sprite.height() / 2.0))});
    }
  }

 private:
  std::vector<Shape> shapes_;
  std::vector<Leaf> leaves_;
};

class Foliage : public Effect {
 public:
  Foliage(Values values, const StreamSource& streams)
      : share_(values[0] / 100),
        cover_(values[1] / 100),
        size_(values[2] / 100),
        wind_(values[3] / 100),
        rest_(values[4]),
        streams_(streams) {}

  void plan(Plan& plan) override {
    Stream stream = streams_.at(StreamSource::kSetup);
    const double width = plan.width, height = plan.height, side = std::sqrt(width * height);
    const double length = std::max(1.0, size_ * side);
    std::vector<Shape> shapes(kShapes);
    for (Shape& shape : shapes) {
      const double angle = stream.uniform(0, std::numbers::pi);
      const double bright = stream.uniform(0.6, 1.35);
      const double green[3] = {62 * bright * stream.uniform(0.8, 1.25),
                               112 * bright * stream.uniform(0.8, 1.25),
                               46 * bright * stream.uniform(0.8, 1.25)};
      for (int turn = 0; turn < kTurns; ++turn) {
        const double turned = 2.0 * turn / (kTurns - 1) - 1;
        // A leaf that turns catches another light.
        const double light = 1 + 0.3 * turned;
        shape[static_cast<size_t>(turn)] = draw_leaf(
            length, angle + kTurn * turned,
            {to_level(green[0] * light), to_level(green[1] * light), to_level(green[2] * light)});
      }
    }
    // Leaves at random places leave exp(-their area over the picture's) of it free.
    const double area = kFilled * length * length;
    const double count = -std::log(1 - cover_) * share_ * width * height / area;
    std::vector<Leaf> leaves(static_cast<size_t>(std::min<double>(std::ceil(count), kMostLeaves)));
    // Plastic numbers (Roberts 2018) leave no part of the picture without leaves, or with too many.
    constexpr double kStepX = 0.7548776662466927, kStepY = 0.5698402909980532;
    double x = stream.uniform(), y = stream.uniform();
    for (Leaf& leaf : leaves) {
      x = std::fmod(x + kStepX, 1), y = std::fmod(y + kStepY, 1);
      leaf.x = x * share_ * width;
      leaf.y = y * height;
      leaf.shape = static_cast<size_t>(stream.index(kShapes));
      leaf.amplitude = wind_ * side * stream.uniform(0.5, 1.2);
      for (double& phase : leaf.phase) phase = stream.uniform(0, 2 * std::numbers::pi);
      for (double& frequency : leaf.frequency) frequency = stream.uniform(0.2, 0.6);
      if (leaf.x < 0.3 * width && leaf.y < 0.35 * height) leaf.rests_until = rest_;
    }
    plan.actors.push_back(std::make_unique<Branches>(std::move(shapes), std::move(leaves)));
  }

 private:
  double share_, cover_, size_, wind_, rest_;
  StreamSource streams_;
};

constexpr Parameter kParameters[] = {
    {"share", "%", 70, 0, 100, "how much of the picture, from the left, has leaves before it"},
    {"cover", "%", 80, 1, 99, "how much of that they hide at a time"},
    {"size", "%", 40, 2, 100, "length of a leaf, of the side of a square as large as the picture"},
    {"wind", "%", 40, 0, 200, "how far leaves move from their places, of the same side"},
    {"rest", "s", 0, 0, 36000, "leaves in the upper left corner do not move before"},
};

}  // namespace

const EffectInfo kFoliage = {"foliage",
                             "clutter: leaves near the camera wave in the wind before most of the "
                             "picture; they are foreground",
                             0,
                             kRandom | kBuffers,
                             kParameters,
                             make_effect<Foliage>};

}  // namespace qdmd::scene
