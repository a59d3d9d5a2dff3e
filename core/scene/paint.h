// SPDX-License-Identifier: LGPL-2.1-or-later
// Pixel work that every scene needs: sprites onto pictures, cropping, light.
#pragma once

#include <cmath>

#include "core/scene/actor.h"
#include "core/scene/effect.h"
#include "core/scene/raster.h"

namespace qdmd::scene {

// Calls `visit(y, x, length, run, skipped)` for the visible part of each run of the sprite at
// (x, y) of a canvas; `skipped` pixels of the run lie to the left of it.
template <typename Visit>
void visit_runs(const Sprite& sprite, int x, int y, int width, int height, Visit visit) {
  for (const Sprite::Run& run : sprite.runs) {
    const int row = y + run.y;
    if (row < 0 || row >= height) continue;
    const int left = std::max(x + run.x, 0), right = std::min(x + run.x + run.length, width);
    if (left < right) visit(row, left, right - left, run, left - (x + run.x));
  }
}

// (x, y) in the canvas's coordinates.
void paint_sprite(const Sprite& sprite, int x, int y, Picture* canvas);
void paint_coverage(const Sprite& sprite, int x, int y, uint8_t coverage, Plane* canvas);

// What falls into the frame at (x, y), in its coordinates, falls again one `width` and one `height`
// farther on over the whole canvas, however large that is: calls `paint(x, y)`, in the canvas's
// coordinates, for each that comes nearer than `reach` to the canvas.
template <typename Paint>
void repeat_over_canvas(const FrameState& state, double x, double y, double width, double height,
                        double reach, Paint paint) {
  const auto first = [&](double at, double period) {
    return at - period * std::floor((at + state.margin + reach) / period);
  };
  for (double v = first(y, height); v < state.height + state.margin + reach; v += height)
    for (double u = first(x, width); u < state.width + state.margin + reach; u += width)
      paint(u + state.margin, v + state.margin);
}

// The frame out of a canvas, looked at beside its place by a fraction of pixels: bilinear between
// the four neighbours. (left, top) of the canvas is the frame's first pixel at shift 0; shifts stay
// inside the canvas.
void crop(const Picture& canvas, double left, double top, Picture* frame);
// Crops a plane as a picture, but rounds up, so that a pixel that an object touches at all is not
// 0.
void crop(const Plane& canvas, double left, double top, Plane* frame);
// Crops a frame that is turned clockwise around its middle, by `turn` radians.
void crop_turned(const Picture& canvas, double left, double top, double turn, Picture* frame);
void crop_turned(const Plane& canvas, double left, double top, double turn, Plane* frame);

// Light is multiplied before the camera's curve: with an exponent g above 1, levels v are those of
// the light ((v + b) / (255 + b))^g, b being black_of_curve(g). That is sRGB's curve for 2.4, above
// the light in which it is a line. What is brighter than 255 is clipped.
void apply(const Light& light, Picture* picture);
// Levels by which the curve of that exponent lies below a power at black.
inline double black_of_curve(double gamma) { return 0.055 * 255 * (gamma - 1) / 1.4; }
// The mean factor of all local over a frame of that size, seen at 16 x 16 places.
double mean_local_light(const Light& light, int width, int height);

// Makes all channels of a pixel its luma (BT.601), times `brightness`.
void take_colour(double brightness, Picture* picture);

// kBackgroundLabel, kShadowLabel, kPartLabel or kObjectLabel in place of the coverage.
void to_labels(const Plane& shadow, Plane* coverage);

}  // namespace qdmd::scene
