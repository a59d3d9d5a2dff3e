// SPDX-License-Identifier: LGPL-2.1-or-later
// The still world of every scene: a street with a tree, a canal and a shop window.
#pragma once

#include "core/scene/random.h"
#include "core/scene/raster.h"

namespace qdmd::scene {

// Painted once, on a canvas that reaches `margin` pixels beyond the frame on every side; regions
// and colours are at the frame's proportions. The seed decides colours and textures. The frame's
// part does not depend on the margin.
class Backdrop {
 public:
  // width, height >= 1; margin >= 0.
  Backdrop(int width, int height, int margin, const StreamSource& streams);

  const Picture& picture() const { return picture_; }
  int margin() const { return margin_; }
  // In canvas coordinates.
  const Box& tree_crown() const { return tree_crown_; }
  const Box& canal() const { return canal_; }
  const Box& shop_window() const { return shop_window_; }

  // The mean level of a box, in the frame's coordinates, per channel; of the whole frame where no
  // part of the box is in it.
  std::array<double, 3> mean(const Box& box) const;
  // The standard deviation of the levels there, mean over the channels.
  double contrast(const Box& box) const;

 private:
  // What of the box is in the frame, in canvas coordinates; the whole frame where nothing is.
  Box seen(const Box& box) const;

  int margin_;
  Picture picture_;
  Box tree_crown_, canal_, shop_window_;
};

// The parts of the street, in shares of the frame's height.
inline constexpr double kHorizon = 0.30;   // where the houses begin, on average
inline constexpr double kPavement = 0.62;  // where the houses end
inline constexpr double kRoad = 0.70;
inline constexpr double kCanal = 0.90;

}  // namespace qdmd::scene
