// SPDX-License-Identifier: LGPL-2.1-or-later
// Who moves through a scene, and where everybody is at a time.
#pragma once

#include <functional>
#include <vector>

#include "core/scene/random.h"
#include "core/scene/sprite.h"

namespace qdmd::scene {

// A sprite in the frame; (x, y) is its top left corner in the frame's coordinates.
struct Placement {
  const Sprite* sprite = nullptr;
  int x = 0, y = 0;
  // The truth has it in the background: it has not moved yet.
  bool part_of_background = false;
  // Who of its actor's it is: the same from frame to frame.
  int64_t who = 0;

  int feet() const { return y + sprite->height(); }
  // Around the opaque pixels.
  Box box() const {
    const Box& extent = sprite->extent;
    return {x + extent.x, y + extent.y, extent.width, extent.height};
  }
};

// Places follow from the time alone, so that every frame can be asked for first.
class Actor {
 public:
  virtual ~Actor() = default;
  // Appends what is there at `time` (seconds, >= 0), perhaps outside of the frame.
  virtual void place(double time, std::vector<Placement>* placements) const = 0;
};

// What clothes a figure that moves in `region` (of the frame) wears.
using Dress = std::function<Sprite(const Sprite&, const Box& region)>;

// One person in some phases of the step, in both directions.
class Person {
 public:
  Person(int height, Stream& stream, const Dress& dress, const Box& region);

  int width() const { return forward_.front().width(); }
  int height() const { return forward_.front().height(); }
  // `walked` is the way in pixels since some start; its sign is the direction looked in.
  const Sprite& at(double walked, bool forward) const;

 private:
  std::vector<Sprite> forward_, backward_;
};

// At most `wanted`, at least 1, and no wider than the frame.
int person_height(int frame_width, int wanted);

// How far beyond the frame those who leave it go, in its widths: a camera that shakes sees a little
// of what is beside it.
inline constexpr double kBeyond = 0.05;

// The mover of the default scene: persons cross the frame, one after the other, in turn from the
// left and from the right. Crossing takes kCrossing seconds, and `pause` more in the middle: no
// whole number, so that a camera that takes a frame every few seconds does not always see the same.
class Crossing : public Actor {
 public:
  static constexpr double kCrossing = 4.7;

  Crossing(int width, int height, double pause, const StreamSource& streams, const Dress& dress);
  void place(double time, std::vector<Placement>* placements) const override;

 private:
  int width_, height_;
  double pause_;
  StreamSource streams_;
  std::vector<Person> people_;
};

}  // namespace qdmd::scene
