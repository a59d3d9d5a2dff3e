// SPDX-License-Identifier: LGPL-2.1-or-later
// Figures that move through a scene: opaque pixels with hard edges, drawn once.
#pragma once

#include <span>
#include <vector>

#include "core/scene/raster.h"

namespace qdmd::scene {

// A picture of which some pixels are opaque, row by row as runs.
struct Sprite {
  struct Run {
    int y, x, length;
  };

  Picture picture;
  std::vector<Run> runs;  // from top to bottom, each row from left to right
  int area = 0;           // opaque pixels
  Box extent;             // the smallest box around them
  std::array<double, 3> mean{};

  int width() const { return picture.width; }
  int height() const { return picture.height; }
};

// A person's width over the height.
inline constexpr double kWidthOfPerson = 0.42;

// A walking person at `phase` (0 .. 1) of the step. At least one pixel is opaque in every sprite.
Sprite draw_person(int height, const Colour& coat, const Colour& trousers, double phase);
// A van seen from the side.
Sprite draw_van(int width, int height, const Colour& paint);
// A lorry that fills its rectangle: every pixel is opaque.
Sprite draw_lorry(int width, int height, const Colour& paint);
// A long, flat boat of one colour, in which people sit, each in a coat.
Sprite draw_boat(int width, int height, const Colour& paint, std::span<const Colour> coats);
// A bag that somebody may leave.
Sprite draw_bag(int height, const Colour& leather);
// A leaf near the camera: `length` pixels from stalk to tip, turned by `angle` radians, with ribs.
Sprite draw_leaf(double length, double angle, const Colour& green);
// The figure facing the other way.
Sprite mirrored(const Sprite& sprite);
// Moves every opaque pixel so that the mean is `mean`, with the texture at `contrast` of itself.
Sprite repainted(const Sprite& sprite, const std::array<double, 3>& mean, double contrast);

}  // namespace qdmd::scene
