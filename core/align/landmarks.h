// SPDX-License-Identifier: LGPL-2.1-or-later
// Pixels of a picture by which its place is found in other pictures.
#pragma once

#include <cstdint>
#include <vector>

#include "core/align/pose.h"
#include "core/base/ignored_areas.h"

namespace qdmd {

// A grey picture in somebody's memory, rows without gaps.
struct GreyView {
  const uint8_t* samples = nullptr;
  int width = 0, height = 0;
};

// Light over the whole picture: the grey levels of a frame are (1 + gain) * (level - 128) + 128 +
// offset, where `level` is a level of the landmarks' own picture.
struct GreyLight {
  double gain = 0, offset = 0;
  // It is another one than the landmarks' picture has: samples at the end of their range show other
  // edges then, and say nothing.
  bool is_other = false;
};

// How a frame fits at a pose.
struct Fit {
  Pose pose;         // of the frame, by one step of Gauss and Newton
  GreyLight light;   // over the landmarks' picture
  double noise = 0;  // levels: the standard deviation of those landmarks that fit
  // Share of the landmarks inside the frame that fit before the step, 0 .. 1. Each counts the more
  // the better it fits: 1 less Tukey's loss.
  double agree = 0;
  double error = 0;          // pixels: the standard deviation of the step's shift
  bool known = false;        // there were enough of them
  bool light_known = false;  // or enough for the light alone
};

// Pixels at edges, spread over the picture.
class Landmarks {
 public:
  // Takes all memory. most: of them.
  explicit Landmarks(int most = 0);
  static uint64_t bytes(int most);

  // Chooses landmarks of `picture` in place of the old ones; none of them is in `ignored`.
  void choose(const GreyView& picture, const IgnoredAreas& ignored, int ignored_scale);
  int count() const { return count_; }
  // How many of 4 x 4 parts of the picture have landmarks. If all of them belong to one thing in
  // front of a bare wall, they are in a few parts only, and move with that thing.
  int parts() const;
  // Landmarks that are needed to say anything.
  static constexpr int kFewest = 12;

  // Compares a frame, seen from `pose`, with the landmarks' picture: the inverse compositional step
  // (Baker and Matthews 2004) with Tukey's weights. Their scale comes from the lower part of the
  // residuals, so that things that move in front of more than half of the landmarks do not count.
  // turns: angle and scale are free, too. noise: taken in place of the residuals' own; 0: not.
  Fit step(const GreyView& frame, const Pose& pose, const GreyLight& light, bool turns,
           double noise = 0);
  // The share of the landmarks that a frame fits at a whole shift by less than `limit` levels.
  double share_within(const GreyView& frame, int x, int y, const GreyLight& light,
                      double limit) const;

 private:
  void read(const GreyView& frame, const Pose& pose, const GreyLight& light);
  double noise_of_residuals() const;
  template <int kFree>
  Fit solved(Fit fit) const;

  int most_, count_ = 0, width_ = 0, height_ = 0;
  std::vector<int32_t> x_, y_;
  std::vector<float> level_, right_, down_;  // levels, and their slopes a pixel
  std::vector<uint8_t> at_end_;  // 1 where samples around it may be at the end of their range
  // Residuals of the frame that is compared, those that say nothing far away: outside of it, and
  // at the end of samples' range in another light.
  std::vector<float> residual_;
};

}  // namespace qdmd
