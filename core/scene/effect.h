// SPDX-License-Identifier: LGPL-2.1-or-later
// What an effect is: its description, the stages of a frame in which it takes part, its needs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/scene/actor.h"
#include "core/scene/backdrop.h"
#include "core/scene/random.h"
#include "core/scene/raster.h"

namespace qdmd::scene {

// A frame goes through these in order. The true background takes part in world, lens, light and
// meter, the mask in expose and lens.
enum Stage : unsigned {
  kWorld = 1 << 0,   // the background of this frame
  kGround = 1 << 1,  // what objects do to the background: shadows, mirror images
  kExpose = 1 << 2,  // how long the shutter is open while objects move
  kAir = 1 << 3,     // between the objects and the camera
  kLens = 1 << 4,    // where the picture falls, and how sharp
  kLight = 1 << 5,   // how much light there is
  kMeter = 1 << 6,   // what the camera's exposure makes of that
  kSensor = 1 << 7,  // what happens to the picture after that
  kLink = 1 << 8,    // which frame's picture arrives
};

enum Need : unsigned {
  kRandom = 1 << 0,   // random numbers, from the stream of its own name
  kWarp = 1 << 1,     // a canvas larger than the frame
  kBuffers = 1 << 2,  // memory of its own, of the picture's size or for tables
};

// Light that falls on a part of the frame: an ellipse around (x, y), in pixels of the frame.
struct LocalLight {
  double x, y, radius_x, radius_y;
  double edge;      // share of the radius over which it fades, at the rim
  double strength;  // of the light around it; it is added inside, below 0 taken away

  // The factor of the light at a place.
  double factor(double at_x, double at_y) const {
    const double distance = std::hypot((at_x - x) / radius_x, (at_y - y) / radius_y);
    const double inside = std::clamp((1 - distance) / edge, 0.0, 1.0);
    return 1 + strength * inside * inside * (3 - 2 * inside);
  }
};

// Light in a frame, and what the camera makes of it.
struct Light {
  std::array<double, 3> gain{1, 1, 1};  // factors of the light
  std::vector<double> rows;       // one factor a row of the frame; empty: the same light everywhere
  std::vector<LocalLight> local;  // light that falls on parts of the frame
  double gamma = 1;               // exponent of the camera's curve; 1: levels are the light
  double grey = 0;                // brightness of a picture without colour; 0: it has colours

  void scale(double factor) {
    for (auto& value : gain) value *= factor;
  }
  // Daylight; whatever sets rows does so in every frame.
  void reset() {
    gain = {1, 1, 1};
    local.clear();
    gamma = 1, grey = 0;
  }
};

// What is asked for. Nothing else is computed.
enum Wanted : unsigned { kFrame = 1 << 0, kTruth = 1 << 1, kLabels = 1 << 2, kBoxes = 1 << 3 };

// A frame in the making. Pictures are canvases, `margin` larger than the frame on every side, until
// the lens has cropped them.
struct FrameState {
  unsigned wanted = kFrame;
  int64_t index = 0;
  double time = 0;                        // seconds
  double interval = 0;                    // seconds between frames of the camera's clock
  int width = 0, height = 0, margin = 0;  // pixels of the frame, and around it

  Picture world;                    // the background of this frame
  Sprite front;                     // what of it is nearer than any object; no runs: nothing
  Picture picture, truth;           // with objects, without
  Plane coverage;                   // 255 where an object covers the whole pixel
  Plane shadow;                     // 255 where an object changes the ground
  double shift_x = 0, shift_y = 0;  // pixels by which the frame looks beside its place
  double turn = 0;                  // radians by which it is turned clockwise around its middle
  Light light;

  bool wants(Wanted what) const { return (wanted & what) != 0; }
};

// Paints the objects, and what they do to the ground, as they are at a time.
using PaintObjects = std::function<void(double time)>;

// What the effects decide once, before the first frame.
struct Plan {
  int width = 0, height = 0;
  double interval = 0;  // seconds of the camera's clock between frames
  const Backdrop* backdrop = nullptr;
  // The mean level that a camera would meter at a time, before its own exposure.
  std::function<double(double time)> metered;

  // Set by effects.
  double pace = 0;      // seconds of the scene between frames; 0: interval
  int64_t length = 0;   // frames; 0: endless
  double pause = 0;     // seconds that the mover of the default scene stands in the middle
  bool crossed = true;  // persons cross the frame, as in the default scene
  Dress dress;          // what objects wear; empty: their own clothes
  std::vector<std::unique_ptr<Actor>> actors;
};

// Each effect overrides the stages that its EffectInfo names, and only these are called; plan() is
// called once, before the first frame.
class Effect {
 public:
  virtual ~Effect() = default;
  // Pixels that it needs around a frame of that size.
  virtual int margin(int /*width*/, int /*height*/) const { return 0; }

  virtual void plan(Plan&) {}
  virtual void world(FrameState&) {}
  virtual void ground(FrameState&, std::span<const Placement>) {}
  virtual void expose(FrameState&, const PaintObjects&) {}
  virtual void air(FrameState&) {}
  virtual void lens(FrameState&) {}
  // Multiplies the light of a time in seconds.
  virtual void light(double /*time*/, Light*) const {}
  virtual void meter(double /*time*/, Light*) const {}
  virtual void sensor(FrameState&) {}
  // The frame, 0 .. index, whose picture is seen as that of frame `index`.
  virtual int64_t arrives(int64_t index) const { return index; }
};

struct Parameter {
  const char* name;
  const char* unit;
  double standard, minimum, maximum;
  const char* description;
  bool whole = false;  // only whole numbers
};

// The values of an effect's parameters, in the order of its EffectInfo, each inside its range.
using Values = std::span<const double>;

struct EffectInfo {
  const char* name;
  const char* description;
  unsigned stages;                        // of Stage
  unsigned needs;                         // of Need
  std::span<const Parameter> parameters;  // "name=1.5" sets the first
  std::unique_ptr<Effect> (*make)(Values values, const StreamSource& streams);
};

// Every effect, in the order in which those of one stage take part.
std::span<const EffectInfo* const> effects();

}  // namespace qdmd::scene
