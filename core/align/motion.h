// SPDX-License-Identifier: LGPL-2.1-or-later
// How a camera has moved between a picture of its scene and a frame.
#pragma once

#include <cstdint>
#include <vector>

#include "core/align/landmarks.h"

namespace qdmd {

// What a frame shows of the camera's motion.
struct Motion {
  // `rest` where it differs by less than a tenth of a pixel from it, or by less than can be known.
  Pose pose;
  double agree = 0;    // share of the landmarks that fit, 0 .. 1
  bool found = false;  // else the pose is nothing: too little fits
};

// Compares frames with landmarks of a reference picture: at rest by a single look at full
// resolution; where that does not fit, coarse to fine on a pyramid of means of 2 x 2 pixels, from a
// search over whole shifts on its top.
class MotionFinder {
 public:
  MotionFinder() = default;
  // Takes all memory.
  MotionFinder(int width, int height);
  static uint64_t bytes(int width, int height);

  // The picture that frames are compared with from now on, at rest. Nothing at `ignored` counts.
  void take_reference(const uint8_t* grey, const IgnoredAreas& ignored);
  bool known() const { return known_; }
  void forget();
  // Too little in the reference tells where it is: nothing moves then.
  bool is_blank() const { return blank_; }

  // Finds that of a frame, which comes after one that was at `before`; it is looked for at `rest`
  // first. turns: angle and scale are free.
  Motion find(const uint8_t* grey, const Pose& before, const Pose& rest, bool turns);

 private:
  struct Level {
    int width, height;
    std::vector<uint8_t> picture;  // of the frame, or of the reference while it is taken in; the
                                   // first level has none
    Landmarks marks;
  };
  void build(const uint8_t* grey);
  GreyView view(size_t level, const uint8_t* grey) const;
  Pose search(const uint8_t* grey, const Pose& before) const;
  Fit find_afar(const uint8_t* grey, const Pose& before, bool turns);
  Fit refine(size_t level, const uint8_t* grey, Pose pose, bool turns, int steps, double enough);

  std::vector<Level> levels_;
  bool known_ = false, blank_ = false;
  GreyLight light_;   // of the newest frame that was found
  double noise_ = 0;  // levels, of frames that were found; 0: of none yet
};

}  // namespace qdmd
