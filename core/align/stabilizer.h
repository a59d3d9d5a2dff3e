// SPDX-License-Identifier: LGPL-2.1-or-later
// Follows a camera that shakes: the pose of each frame of a stream.
#pragma once

#include <cstdint>
#include <vector>

#include "core/align/motion.h"
#include "core/align/resampler.h"
#include "core/base/channels.h"
#include "core/base/colours.h"

namespace qdmd {

// How the camera may move.
enum class Stabilize {
  off,          // it stands still, whatever frames show
  translation,  // it looks beside its place
  similarity    // and is turned, and sees more or less
};

// Frames are compared with the first one, and later with the background that was learnt. The canvas
// is the first frame. If the camera moves from the beginning, the canvas is moved by less than a
// pixel after the first few frames, to where the sharpest of them falls on whole pixels:
// interpolation then does not blur that frame. If the camera looks further beside its place than an
// eighth of the picture, it shows another view, and the newest frame is the canvas.
class Stabilizer {
 public:
  // Takes all memory. For frames of width x height pixels.
  Stabilizer(Stabilize how, Colours colours, int width, int height);
  static uint64_t bytes(int width, int height);

  // The next frame is of another stream.
  void forget();
  // The next frame begins a new scene, and is its canvas.
  void begin_scene();
  // True if the newest frame shows another view, to which the camera moved.
  bool began_view() const { return began_view_; }
  // The channel that frames are compared by.
  int channel() const { return channel_; }

  // The pose from which the next frame is moved; `grey` is a channel of that frame. If it shows too
  // little of the scene, this is the pose of the frame before.
  Pose follow(const uint8_t* grey, const IgnoredAreas& ignored);
  // Where the newest frame's canvas lies on the canvas of the frames before; nearly always at rest.
  const Pose& canvas_moved() const { return canvas_moved_; }
  // The background picture that frames are compared with from now on.
  void refer_to(const uint8_t* grey, const IgnoredAreas& ignored);
  // Frames since that.
  int64_t frames_since_reference() const { return since_reference_; }

  // Where the camera looked in the newest frame. Frames are moved only once the camera was further
  // off than the width of an edge: for less, interpolation would blur more than the motion does.
  const Pose& motion() const { return pose_; }
  // How often the camera went on to another view.
  uint64_t views() const { return views_; }
  Resampler& resampler() { return resampler_; }

 private:
  void begin(const uint8_t* grey, const IgnoredAreas& ignored);
  double sharpness(const uint8_t* grey) const;
  void choose_canvas(const uint8_t* grey);
  Pose applied();

  bool turns_;
  int channel_, width_, height_;
  MotionFinder finder_;
  Resampler resampler_;
  int candidates_ = 0;   // frames that are still compared
  double sharpest_ = 0;  // of those that were, and where its camera looked
  Pose sharpest_pose_;
  Point way_;    // the sum of their shifts
  Pose offset_;  // of the canvas, from the picture that frames are compared with
  Pose canvas_moved_;
  bool anew_ = true;
  Pose pose_;
  bool awake_ = false;
  int calm_ = 0;  // frames in a row that nearly were at rest
  int lost_ = 0, beyond_ = 0;
  bool began_view_ = false;
  int64_t since_reference_ = 0;
  uint64_t views_ = 0;
};

}  // namespace qdmd
