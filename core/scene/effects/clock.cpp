// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <array>
#include <cmath>

namespace qdmd::scene {
namespace {

// The segments of a digit, from the top clockwise around, and the one in the middle: bits 0 .. 6.
constexpr std::array<unsigned, 10> kSegments = {0x3f, 0x06, 0x5b, 0x4f, 0x66,
                                                0x6d, 0x7d, 0x07, 0x7f, 0x6f};

// A recorder writes the time into the picture: hours, minutes and seconds, white with a black rim.
class RecorderClock : public Effect {
 public:
  RecorderClock(Values values, const StreamSource&)
      : height_(values[0]), x_(values[1]), y_(values[2]), start_(values[3]) {}

  void sensor(FrameState& state) override {
    const int high = std::max(7, static_cast<int>(std::lround(height_ * state.height)));
    const Digits shape = {high, std::max(4, high / 2), std::max(1, high / 7)};
    const auto seconds = static_cast<int64_t>(std::floor(start_ + state.time + kSlack));
    const std::array<int64_t, 6> digits = {seconds / 36000 % 10, seconds / 3600 % 10,
                                           seconds / 600 % 6,    seconds / 60 % 10,
                                           seconds / 10 % 6,     seconds % 10};
    const int step = shape.wide + 2 * shape.thick, whole = 8 * step;
    int x = static_cast<int>(x_ * std::max(0, state.width - whole)) + shape.thick;
    const int y =
        static_cast<int>(y_ * std::max(0, state.height - high - 2 * shape.thick)) + shape.thick;
    for (size_t i = 0; i < digits.size(); ++i) {
      if (i == 2 || i == 4) {
        for (const int at : {high / 3, 2 * high / 3})
          fill({x + shape.wide / 2, y + at, shape.thick, shape.thick}, 0, 235, &state);
        x += step;
      }
      draw_digit(kSegments[static_cast<size_t>(digits[i])], x, y, shape, &state);
      x += step;
    }
  }

 private:
  // Forgives the rounding of a frame's time.
  static constexpr double kSlack = 5e-7;
  // Pixels of a digit, and of its strokes.
  struct Digits {
    int high, wide, thick;
  };

  static void draw_digit(unsigned segments, int x, int y, const Digits& of, FrameState* state) {
    const int right = x + of.wide - of.thick, half = of.high / 2;
    const Box boxes[] = {{x, y, of.wide, of.thick},
                         {right, y, of.thick, half},
                         {right, y + half, of.thick, of.high - half},
                         {x, y + of.high - of.thick, of.wide, of.thick},
                         {x, y + half, of.thick, of.high - half},
                         {x, y, of.thick, half},
                         {x, y + half - of.thick / 2, of.wide, of.thick}};
    // Rims first: they hide no stroke.
    for (const bool rim : {true, false})
      for (unsigned i = 0; i < std::size(boxes); ++i)
        if (segments >> i & 1) fill(boxes[i], rim ? 1 : 0, rim ? 16 : 235, state);
  }
  static void fill(const Box& box, int rim, uint8_t level, FrameState* state) {
    const Box seen =
        intersection({box.x - rim, box.y - rim, box.width + 2 * rim, box.height + 2 * rim},
                     {0, 0, state->width, state->height});
    for (int y = seen.y; y < seen.bottom(); ++y)
      std::fill_n(state->picture.at(seen.x, y), 3 * seen.width, level);
  }

  double height_, x_, y_, start_;
};

constexpr Parameter kParameters[] = {
    {"height", "of the height", 0.08, 0.03, 0.5, "of a digit"},
    {"x", "of the width", 0.96, 0, 1, "where it stands: 0 left, 1 right"},
    {"y", "of the height", 0.04, 0, 1, "where it stands: 0 top, 1 bottom"},
    {"start", "s", 43170, 0, 86400, "the time of the first frame, after midnight"},
};

}  // namespace

const EffectInfo kClock = {
    "clock",
    "overlay: a recorder writes the time into each frame, which the truth does not have",
    kSensor,
    0,
    kParameters,
    make_effect<RecorderClock>};

}  // namespace qdmd::scene
