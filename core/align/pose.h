// SPDX-License-Identifier: LGPL-2.1-or-later
// Where a camera that moves a little looks.
#pragma once

#include <algorithm>
#include <cmath>

namespace qdmd {

// Where a frame's pixels are on the canvas, the picture that the camera saw in its place of rest:
// the frame's pixel f shows the canvas at c + shift + scale R(angle) (f - c), where c is the middle
// of the picture and angles turn x towards y (clockwise, y being down).
struct Pose {
  double x = 0, y = 0;  // pixels by which the camera looks to the right and down
  double angle = 0;     // radians
  double scale = 1;     // above 1: it sees more

  bool operator==(const Pose&) const = default;
  bool is_rest() const { return *this == Pose(); }
  bool is_shift() const { return angle == 0 && scale == 1; }
};

// A point or a way, in pixels.
struct Point {
  double x = 0, y = 0;
};

// q = offset + matrix p: what a pose, or its inverse, is for pictures of one size.
struct Affine {
  double xx = 1, xy = 0, yx = 0, yy = 1;
  Point offset;

  Point operator()(double x, double y) const {
    return {offset.x + xx * x + xy * y, offset.y + yx * x + yy * y};
  }
};

inline Point middle_of(int width, int height) { return {(width - 1) / 2.0, (height - 1) / 2.0}; }

inline Affine affine(const Pose& pose, Point middle) {
  const double a = pose.scale * std::cos(pose.angle), b = pose.scale * std::sin(pose.angle);
  return {a,
          -b,
          b,
          a,
          {middle.x + pose.x - a * middle.x + b * middle.y,
           middle.y + pose.y - b * middle.x - a * middle.y}};
}

// From the canvas to a frame.
inline Pose inverse(const Pose& pose) {
  const double a = std::cos(pose.angle) / pose.scale, b = std::sin(pose.angle) / pose.scale;
  return {-(a * pose.x + b * pose.y), -(-b * pose.x + a * pose.y), -pose.angle, 1 / pose.scale};
}

// The same of a picture that is so many times as large.
inline Pose enlarged(const Pose& pose, int scale) {
  return {scale * pose.x, scale * pose.y, pose.angle, pose.scale};
}

// First `inner`, then `outer`.
inline Pose compose(const Pose& outer, const Pose& inner) {
  const double a = outer.scale * std::cos(outer.angle), b = outer.scale * std::sin(outer.angle);
  return {outer.x + a * inner.x - b * inner.y, outer.y + b * inner.x + a * inner.y,
          outer.angle + inner.angle, outer.scale * inner.scale};
}

// Pixels between where a pixel is in two poses, at most, in a picture of that size.
inline double largest_way(const Pose& a, const Pose& b, int width, int height) {
  const Point middle = middle_of(width, height);
  const double da = a.scale * std::cos(a.angle) - b.scale * std::cos(b.angle);
  const double db = a.scale * std::sin(a.angle) - b.scale * std::sin(b.angle);
  double most = 0;
  for (const double u : {-middle.x, middle.x})
    for (const double v : {-middle.y, middle.y})
      most = std::max(most, std::hypot(a.x - b.x + da * u - db * v, a.y - b.y + db * u + da * v));
  return most;
}

}  // namespace qdmd
