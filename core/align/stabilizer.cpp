// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/align/stabilizer.h"

#include <algorithm>
#include <cmath>

namespace qdmd {
namespace {

// First frames of which one is the sharpest.
constexpr int kFirstFrames = 16;
// Frames until another one is tried where the first one shows nothing.
constexpr int kTryAgain = 8;

// A frame for which the canvas is moved is sharper by so much.
constexpr double kSharper = 1.03;
// Pixels that wake it, and so little for so many frames that it sleeps again.
constexpr double kWakes = 0.75, kCalm = 0.2;
constexpr int kSleeps = 250;
// The share of the picture's longer side beyond which the camera shows another view.
constexpr double kFarthest = 1.0 / 8;
// Frames in a row that are beyond that, and that show nothing that is known.
constexpr int kBeyond = 8, kLost = 100;

}  // namespace

Stabilizer::Stabilizer(Stabilize how, Colours colours, int width, int height)
    : turns_(how == Stabilize::similarity),
      // Green is most of what is seen.
      channel_(colours == Colours::rgb ? 1 : 0),
      width_(width),
      height_(height),
      finder_(width, height) {}

uint64_t Stabilizer::bytes(int width, int height) { return MotionFinder::bytes(width, height); }

void Stabilizer::forget() {
  finder_.forget();
  anew_ = true;
  awake_ = false;
  pose_ = {};
  lost_ = beyond_ = 0;
}

void Stabilizer::begin_scene() {
  anew_ = true;
  if (beyond_ > 0) ++views_;
  beyond_ = 0;
}

void Stabilizer::begin(const uint8_t* grey, const IgnoredAreas& ignored) {
  finder_.forget();
  finder_.take_reference(grey, ignored);
  lost_ = beyond_ = 0;
  candidates_ = kFirstFrames;
  sharpest_ = candidates_ > 0 ? kSharper * sharpness(grey) : 0;
  sharpest_pose_ = offset_ = canvas_moved_ = {};
  way_ = {};
  since_reference_ = 0;
  pose_ = {};
  awake_ = false;
  calm_ = 0;
  anew_ = false;
}

// The power of the differences of neighbours.
double Stabilizer::sharpness(const uint8_t* grey) const {
  int64_t sum = 0;
  for (int y = 0; y + 1 < height_; y += 2) {
    const uint8_t* const row = grey + ptrdiff_t{y} * width_;
    int of_row = 0;
    for (int x = 0; x + 1 < width_; ++x) {
      const int right = row[x + 1] - row[x], down = row[x + width_] - row[x];
      of_row += right * right + down * down;
    }
    sum += of_row;
  }
  return static_cast<double>(sum);
}

Pose Stabilizer::follow(const uint8_t* grey, const IgnoredAreas& ignored) {
  ++since_reference_;
  canvas_moved_ = {};
  began_view_ = false;
  if (anew_ || !finder_.known() || (finder_.is_blank() && since_reference_ % kTryAgain == 0)) {
    begin(grey, ignored);
    return pose_;
  }
  const Motion motion =
      finder_.find(grey, compose(inverse(offset_), pose_), inverse(offset_), turns_);
  const Pose pose = motion.pose == inverse(offset_) ? Pose() : compose(offset_, motion.pose);
  const double farthest = kFarthest * std::max(width_, height_);
  const bool beyond = motion.found && std::hypot(pose.x, pose.y) > farthest;
  if (motion.found && !beyond) {
    lost_ = beyond_ = 0;
    pose_ = pose;
    if (candidates_ > 0) choose_canvas(grey);
    return applied();
  }
  ++lost_;
  beyond_ = beyond ? beyond_ + 1 : 0;
  if (beyond_ < kBeyond && lost_ < kLost) return applied();
  if (beyond) ++views_;
  began_view_ = beyond;
  begin(grey, ignored);
  return pose_;
}

// The pose from which the newest frame is moved.
Pose Stabilizer::applied() {
  const double way = largest_way(pose_, Pose(), width_, height_);
  calm_ = way < kCalm ? calm_ + 1 : 0;
  awake_ = way > kWakes || (awake_ && calm_ < kSleeps);
  return awake_ ? pose_ : Pose();
}

void Stabilizer::choose_canvas(const uint8_t* grey) {
  // Who stands still needs no other canvas.
  const double sharp = pose_.is_rest() ? 0 : sharpness(grey);
  if (sharp > sharpest_) sharpest_ = sharp, sharpest_pose_ = pose_;
  way_.x += pose_.x, way_.y += pose_.y;
  if (--candidates_ > 0) return;
  // By whole pixels from the sharpest one, in the middle of all.
  const Pose& to = sharpest_pose_;
  canvas_moved_ = {to.x + std::round(way_.x / kFirstFrames - to.x),
                   to.y + std::round(way_.y / kFirstFrames - to.y), to.angle, to.scale};
  if (!awake_) canvas_moved_ = {};
  if (canvas_moved_.is_rest()) return;
  offset_ = inverse(canvas_moved_);
  pose_ = compose(offset_, pose_);
}

void Stabilizer::refer_to(const uint8_t* grey, const IgnoredAreas& ignored) {
  finder_.take_reference(grey, ignored);
  candidates_ = 0;
  offset_ = {};
  since_reference_ = 0;
  anew_ = false;
}

}  // namespace qdmd
