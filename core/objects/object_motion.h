// SPDX-License-Identifier: LGPL-2.1-or-later
// Where a thing is, how large it is and how it moves: what its regions say of that.
#pragma once

#include "core/objects/object.h"

namespace qdmd {

// A filter of fixed gains, as a Kalman filter of a steady velocity comes to. A region is not always
// the thing: at the edge of the picture it is a part of it, and where something else is in the
// region, too, it is more. Then an edge says where the thing is, and its size is what it was.
class ObjectMotion {
 public:
  ObjectMotion(const ObjectBox& region, int picture_width, int picture_height);

  // Where it is in the next frame, after so many seconds; inside the picture, as far as it is
  // there.
  ObjectBox expect(double seconds) const;
  // It stays where it is.
  ObjectBox box() const { return inside(whole()); }
  // It is the only one in a region. stands: it did not move for long. seconds: since the frame
  // before.
  void follow(const ObjectBox& region, bool stands, double seconds);
  // It is so far from where it was expected, as an edge says of a region that it shares.
  void correct(double dx, double dy, double seconds);
  // Nothing is said of it: it goes on.
  void go_on(double seconds);

  double vx() const { return vx_; }
  double vy() const { return vy_; }
  // It touches an edge of the picture, and goes there.
  bool goes_out() const;
  // Of the whole thing, beyond the picture, too.
  double area() const { return width_ * height_; }

 private:
  ObjectBox whole() const { return {x_ - width_ / 2, y_ - height_ / 2, width_, height_}; }
  ObjectBox inside(const ObjectBox& box) const;

  double picture_width_, picture_height_;
  double x_, y_, width_, height_;  // its middle and its sides, pixels
  double vx_ = 0, vy_ = 0;         // pixels a second
  int frames_ = 1;
  bool was_inside_ = false;  // away from the edges of the picture: all of it was seen
};

}  // namespace qdmd
