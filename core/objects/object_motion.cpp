// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/objects/object_motion.h"

#include <cmath>

namespace qdmd {
namespace {

// What the way of a measured box from where it was expected counts for the velocity; of an edge in
// a shared region: for the place, and for the velocity.
constexpr double kVelocityGain = 0.25, kSharedPlaceGain = 0.5, kSharedVelocityGain = 0.05;
// What a region counts for the size.
constexpr double kSizeGain = 0.04;
// A region that is so much larger has something else in it.
constexpr double kLarger = 1.15;
// Sides a second: what is slower has no edge that goes ahead.
constexpr double kSlow = 0.2;
// Pixels from the edge of the picture.
constexpr double kAtEdge = 1.5;
// Frames after which a size is known.
constexpr int kKnown = 5;

// One axis: a region from `low` to `high` of a picture from 0 to `end`.
struct Measured {
  double middle, size;
};
Measured measure(double low, double high, double end, double expected, double size, double speed,
                 bool known, bool inside) {
  const double seen = high - low;
  const bool at_low = low <= kAtEdge, at_high = high >= end - kAtEdge;
  if (at_low != at_high) {
    // It comes in as far as nobody saw it before; else something comes in beside it.
    const bool other = inside && seen > kLarger * size;
    const double whole = other ? size : std::max(size, seen);
    return {at_low ? high - whole / 2 : low + whole / 2,
            other ? size + kSizeGain * (seen - size) : whole};
  }
  if (!known || seen <= kLarger * size || at_low)
    return {(low + high) / 2, known ? size + kSizeGain * (seen - size) : seen};
  const double slow = kSlow * size, grown = size + kSizeGain * (seen - size);
  if (std::abs(speed) < slow) return {expected, grown};
  return {speed > 0 ? high - size / 2 : low + size / 2, grown};
}

}  // namespace

ObjectMotion::ObjectMotion(const ObjectBox& region, int picture_width, int picture_height)
    : picture_width_(picture_width),
      picture_height_(picture_height),
      x_(region.middle_x()),
      y_(region.middle_y()),
      width_(region.width),
      height_(region.height) {}

ObjectBox ObjectMotion::inside(const ObjectBox& box) const {
  const double left = std::clamp(box.x, 0.0, picture_width_ - 1),
               top = std::clamp(box.y, 0.0, picture_height_ - 1);
  return {left, top, std::clamp(box.right(), left + 1, picture_width_) - left,
          std::clamp(box.bottom(), top + 1, picture_height_) - top};
}

ObjectBox ObjectMotion::expect(double seconds) const {
  ObjectBox box = whole();
  box.x += vx_ * seconds;
  box.y += vy_ * seconds;
  return inside(box);
}

void ObjectMotion::go_on(double seconds) {
  x_ += vx_ * seconds;
  y_ += vy_ * seconds;
}

void ObjectMotion::follow(const ObjectBox& region, bool stands, double seconds) {
  const double x = stands ? x_ : x_ + vx_ * seconds, y = stands ? y_ : y_ + vy_ * seconds;
  const bool known = ++frames_ > kKnown;
  const Measured across =
      measure(region.x, region.right(), picture_width_, x, width_, vx_, known, was_inside_);
  const Measured down =
      measure(region.y, region.bottom(), picture_height_, y, height_, vy_, known, was_inside_);
  vx_ += kVelocityGain * (across.middle - x_ - vx_ * seconds) / seconds;
  vy_ += kVelocityGain * (down.middle - y_ - vy_ * seconds) / seconds;
  was_inside_ |= region.x > kAtEdge && region.right() < picture_width_ - kAtEdge;
  x_ = across.middle, width_ = across.size;
  y_ = down.middle, height_ = down.size;
}

void ObjectMotion::correct(double dx, double dy, double seconds) {
  x_ += kSharedPlaceGain * std::clamp(dx, -width_ / 2, width_ / 2);
  y_ += kSharedPlaceGain * std::clamp(dy, -height_ / 2, height_ / 2);
  vx_ += kSharedVelocityGain * dx / seconds;
  vy_ += kSharedVelocityGain * dy / seconds;
}

bool ObjectMotion::goes_out() const {
  const ObjectBox seen = box();
  const double near = std::max(2 * kAtEdge, picture_height_ / 60);
  return (seen.x < near && vx_ < 0) || (seen.y < near && vy_ < 0) ||
         (seen.right() > picture_width_ - near && vx_ > 0) ||
         (seen.bottom() > picture_height_ - near && vy_ > 0);
}

}  // namespace qdmd
