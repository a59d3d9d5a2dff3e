// Pixels of a picture by which its place is found in other pictures.
#pragma once

#include <cstdint>
#include <vector>

#include "core/align/pose.h"
#include "core/foreground/ignored.h"

namespace qdmd {

// A grey picture in somebody's memory, rows without gaps.
struct GreyView {
  const uint8_t* samples = nullptr;
  int width = 0, height = 0;
};

// Global light: grey levels of a frame are gain * (level - 128) + 128 + offset, less that of the
// landmarks' own picture.
struct GreyLight {
  double gain = 0, offset = 0;
};

// How a frame fits at a pose.
struct Fit {
  Pose pose;         // of the frame, by one step of Gauss and Newton
  GreyLight light;   // over the landmarks' picture
  double noise = 0;  // levels: the standard deviation of those landmarks that fit
  // Share of the landmarks inside of the frame that fit before the step, the better the more (1
  // less Tukey's loss), 0 .. 1.
  double agree = 0;
  double error = 0;    // pixels: the standard deviation of the step's shift
  bool known = false;  // there were enough of them
};

// Pixels at edges, spread over the picture.
class Landmarks {
 public:
  // Takes all memory. most: of them.
  explicit Landmarks(int most = 0);
  static uint64_t bytes(int most);

  // Those of `picture`, in place of the old ones; none where `ignored` is.
  void choose(const GreyView& picture, const IgnoredAreas& ignored, int ignored_scale);
  int count() const { return count_; }
  // How many of 4 x 4 parts of the picture have some. Those of one thing before a bare wall are in
  // a few, and move with it.
  int parts() const;
  // Landmarks that are needed to say anything.
  static constexpr int kFewest = 12;

  // Compares a frame, seen from `pose`, with the landmarks' picture: the inverse compositional step
  // (Baker and Matthews 2004) with Tukey's weights, their scale from the residuals' lower part, so
  // that what moves before more than half of the landmarks does not count. turns: angle and scale
  // are free, too. noise: in place of what the residuals say, or 0.
  Fit step(const GreyView& frame, const Pose& pose, const GreyLight& light, bool turns,
           double noise = 0);
  // The share of the landmarks that a frame fits at a whole shift by less than `limit` levels.
  double share_within(const GreyView& frame, int x, int y, const GreyLight& light,
                      double limit) const;

 private:
  void read(const GreyView& frame, const Pose& pose, const GreyLight& light);
  double noise_of_residuals() const;

  int most_, count_ = 0, width_ = 0, height_ = 0;
  std::vector<int32_t> x_, y_;
  std::vector<float> level_, right_, down_;  // levels, and their slopes a pixel
  // Of the frame that is compared: residuals, those outside of it far away.
  std::vector<float> residual_;
};

}  // namespace qdmd
