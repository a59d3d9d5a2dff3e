// SPDX-License-Identifier: LGPL-2.1-or-later
// When the live mode works on what: frame numbers only, no pixels.
#pragma once

#include <cstdint>

namespace qdmd {

// Spreads the work of a solve over frames so that each frame costs about the same. Frames enter the
// Gram matrix in groups, which end at the latest with the last frame of a hop; a group's inner
// products are computed in slices of pixels, one slice a frame; so are, after the decomposition,
// the pictures of its modes. Everything is fixed by the number of frames, so that results do not
// depend on the machine's speed.
class LivePlan {
 public:
  // What begins with a frame.
  struct Step {
    int group = 0;         // frames that now enter the Gram matrix; 0: none
    int gram_slices = 1;   // frames over which that is spread, this one first
    bool solve = false;    // decompose when the group is complete
    int build_slices = 1;  // frames over which the pictures are spread, beginning after that
  };

  LivePlan() = default;
  // frame_bytes: of one frame in the window. piece_frames: not 0 where a solve is one piece of work
  // beside the frames, not sliced, which has until `build_slices` frames later, at most so many.
  LivePlan(int window_size, int hop_size, uint64_t frame_bytes, int piece_frames = 0);
  // For frames of so many pixels and solves of so many seconds (Learner::solve_seconds()).
  static int piece_frames(uint64_t pixels, double solve_seconds);

  // The next frame is the first of a new window, whose first solve comes with frame `first_solve`.
  void restart(int first_solve);
  // Counts a frame.
  Step next();
  // Frames since restart().
  int64_t frames() const { return frames_; }
  int hop_size() const { return hop_size_; }
  int window_size() const { return window_size_; }

  // True where a solve is so small that it is done at once, with its last frame.
  bool at_once() const { return !in_one_piece() && most_slices() == 1; }
  bool in_one_piece() const { return piece_frames_ > 0; }
  // Frames that arrive while the snapshots of a solve are still needed.
  int most_late_frames() const;

 private:
  int slices(int64_t snapshots) const;
  int most_slices() const { return slices(window_size_); }
  // Frames of the largest group of a whole hop.
  int largest_group() const;
  void plan(int64_t next_solve);

  int window_size_ = 2, hop_size_ = 1;
  uint64_t frame_bytes_ = 0;
  int piece_frames_ = 0;
  int64_t frames_ = 0;
  // The hop that runs: (start_, solve_at_], in `groups_` groups, of which `groups_done_` are over.
  int64_t start_ = 0, solve_at_ = 1;
  int64_t groups_ = 1, groups_done_ = 0;
};

}  // namespace qdmd
