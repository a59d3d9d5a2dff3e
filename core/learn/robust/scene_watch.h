// Notices that the camera shows something else: it was moved, covered, or switched to another view.
#pragma once

#include <cstdint>
#include <vector>

#include "core/passes/grid.h"

namespace qdmd {

// Compares edges: those of the same scene are where they were, in any light and behind any crowd.
// They are differences of neighbouring blocks of 2 x 2 cells, and alike as far as they correlate
// (normalised cross-correlation, -1 to 1).
class SceneWatch {
 public:
  // So many frames that look like each other, and not like the background, are another scene.
  static constexpr int kFrames = 8;

  SceneWatch() = default;
  // Takes all memory.
  explicit SceneWatch(const Grid& grid);
  static uint64_t bytes(const Grid& grid);

  // The frames to come are compared with another background.
  void forget() { strange_ = 0; }
  // The next frame. True: with it, kFrames in a row are of another scene than the background. It
  // counts from there on.
  bool follow(const float* const frame[3], const float* const background[3]);

 private:
  // The edges of a picture, and the sum of their squares.
  struct Edges {
    std::vector<float> steps;
    double energy = 0;
  };
  void find(const float* const planes[3], Edges* edges);
  double alike(const Edges& a, const Edges& b) const;
  bool strange(const Edges& frame);

  Grid grid_;
  size_t rows_ = 0, cols_ = 0;  // of blocks
  std::vector<float> blocks_;
  Edges background_, frames_[kFrames];  // a ring of the newest
  int next_ = 0, strange_ = 0;          // frames in a row
};

}  // namespace qdmd
