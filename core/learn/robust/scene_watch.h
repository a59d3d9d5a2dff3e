// SPDX-License-Identifier: LGPL-2.1-or-later
// Notices that the camera shows something else: it was moved, covered, or switched to another view.
#pragma once

#include <cstdint>
#include <vector>

#include "core/learn/learner.h"
#include "core/learn/robust/learning_steps.h"
#include "core/passes/grid.h"

namespace qdmd {

// Compares edges: those of the same scene are where they were, in any light, and most of them
// behind any crowd. Edges are differences of neighbouring blocks of 2 x 2 cells, compared tile by
// tile by how they correlate (normalised cross-correlation, -1 to 1).
class SceneWatch {
 public:
  // So many frames that look like each other, and not like the background, are another scene.
  static constexpr int kFrames = Learner::kSceneFrames;

  SceneWatch() = default;
  // Takes all memory.
  explicit SceneWatch(const Grid& grid);
  static uint64_t bytes(const Grid& grid);

  // Nothing is known.
  void forget() { strange_ = returned_ = 0, left_known_ = false; }
  // The newest frame of follow() shows the contours of the background.
  bool shows_background() const { return shows_background_; }
  // The frames to come are compared with another background, of another scene.
  void leave();
  // True with the second frame in a row that shows the scene that was left.
  bool is_back(const float* const frame[3]);
  // The next frame. Another scene: it is at least the kFrames-th in a row that does not look like
  // the background, and they look alike. The one before: it is the second in a row that looks like
  // the scene that was left last, and not like the background.
  SceneSeen follow(const float* const frame[3], const float* const background[3]);

 private:
  static constexpr size_t kTilesAlong = steps::scene::kTilesAlong;

  void find_edges(const float* const planes[3], std::vector<float>* edges);
  // What a frame is to a background. Doubtful: strange where there is something to compare, but
  // that is not much.
  enum class Look { same, doubtful, strange };
  Look look_of(const std::vector<float>& frame, const std::vector<float>& background) const;
  bool alike(const std::vector<float>& a, const std::vector<float>& b) const;

  Grid grid_;
  size_t rows_ = 0, cols_ = 0;  // of blocks
  std::vector<float> blocks_;
  // Edges of each channel and block, to the right and down; 0 at the borders.
  std::vector<float> background_, left_, frames_[kFrames];  // the newest ones, a ring
  int next_ = 0, strange_ = 0, returned_ = 0;               // the last two: frames in a row
  bool left_known_ = false, shows_background_ = false;
};

}  // namespace qdmd
