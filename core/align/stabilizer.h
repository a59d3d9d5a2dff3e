// Follows a camera that shakes: the pose of each frame of a stream.
#pragma once

#include <cstdint>
#include <vector>

#include "core/align/motion.h"
#include "core/align/resampler.h"
#include "core/base/channels.h"
#include "core/model/learnt.h"

namespace qdmd {

// How the camera may move.
enum class Stabilize {
  off,          // it stands still, whatever frames show
  translation,  // it looks beside its place
  similarity    // and is turned, and sees more or less
};

// Frames are compared with the first one, and then with the background that was learnt. The canvas
// is the first frame; if the camera moves at once, it is moved by less than a pixel once the first
// few have come, to where the sharpest of them falls on whole pixels, so that this one is not
// blurred by interpolation. A camera that looks further beside its place than an eighth of the
// picture shows another view: the canvas is then the newest frame.
class Stabilizer {
 public:
  // Takes all memory. For frames of width x height pixels.
  Stabilizer(Stabilize how, Colours colours, int width, int height);
  static uint64_t bytes(int width, int height);

  // The next frame is of another stream.
  void forget();
  // The next frame begins a new scene, and is its canvas.
  void begin_scene();
  // The newest frame is of another view, on which the camera went.
  bool began_view() const { return began_view_; }
  // The channel that frames are compared by.
  int channel() const { return channel_; }

  // The pose that the next frame is moved from, whose channel is `grey`. Where too little is seen
  // of the scene, that of the frame before.
  Pose follow(const uint8_t* grey, const IgnoredAreas& ignored);
  // Where the newest frame's canvas is on that of the frames before; at rest nearly always.
  const Pose& canvas_moved() const { return canvas_moved_; }
  // The background picture that frames are compared with from now on.
  void refer_to(const uint8_t* grey, const IgnoredAreas& ignored);
  // Frames since that.
  int64_t frames_since_reference() const { return since_reference_; }

  // Where the newest frame's camera looked. Frames are only moved once it was further off than the
  // width of an edge: interpolation blurs more than less does.
  const Pose& motion() const { return pose_; }
  // Frames in a row that showed too little of the scene, the newest included.
  int lost() const { return lost_; }
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
