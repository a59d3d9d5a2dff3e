// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/live_plan.h"

#include <algorithm>
#include <cmath>

namespace qdmd {
namespace {

// Frames of a group: they fill a register tile of the Gram kernel, and the window is read once for
// all of them.
constexpr int kMostGroup = 16;

// Bytes of the window that a slice reads: what memory delivers in a few milliseconds.
constexpr uint64_t kSliceBytes = uint64_t{32} << 20;

// The snapshots of a solve stay in memory until its pictures are there: more slices would be
// lighter but want more frames.
constexpr int kMostBuildSlices = 8;

// Frames that a solve in one piece goes on for. A background that comes sooner is a better one, and
// small frames have little work to share out: one frame for so many pixels, as long as none has
// more than so many seconds of it. At most about a second, and the frames that it keeps in memory.
constexpr uint64_t kPixelsOfPiece = 1 << 14;
constexpr double kSecondsOfFrame = 3e-3;
constexpr int kShortestPiece = 4, kLongestPiece = 24;

int ceil_divide(int64_t value, int64_t by) { return static_cast<int>((value + by - 1) / by); }

}  // namespace

int LivePlan::piece_frames(uint64_t pixels, double solve_seconds) {
  const double frames = std::max(static_cast<double>(pixels) / static_cast<double>(kPixelsOfPiece),
                                 solve_seconds / kSecondsOfFrame);
  return std::clamp(static_cast<int>(std::ceil(std::min<double>(frames, kLongestPiece))),
                    kShortestPiece, kLongestPiece);
}

LivePlan::LivePlan(int window_size, int hop_size, uint64_t frame_bytes, int piece_frames)
    : window_size_(window_size),
      hop_size_(std::clamp(hop_size > 0 ? hop_size : window_size / 4, 1, window_size)),
      frame_bytes_(frame_bytes),
      piece_frames_(piece_frames) {
  restart(1);
}

int LivePlan::slices(int64_t snapshots) const {
  if (in_one_piece()) return 1;
  const uint64_t bytes = frame_bytes_ * static_cast<uint64_t>(snapshots);
  return static_cast<int>(
      std::clamp<uint64_t>((bytes + kSliceBytes - 1) / kSliceBytes, 1, kMostGroup));
}

int LivePlan::largest_group() const {
  return ceil_divide(hop_size_, ceil_divide(hop_size_, kMostGroup));
}

int LivePlan::most_late_frames() const {
  if (at_once()) return 0;
  if (in_one_piece()) return std::min(piece_frames_, hop_size_) - 1;
  return std::min(most_slices(), largest_group()) - 1 +
         std::min({most_slices(), kMostBuildSlices, hop_size_});
}

void LivePlan::restart(int first_solve) {
  frames_ = 0;
  start_ = 0;
  plan(first_solve);
}

void LivePlan::plan(int64_t next_solve) {
  solve_at_ = next_solve;
  groups_ = ceil_divide(solve_at_ - start_, kMostGroup);
  groups_done_ = 0;
}

LivePlan::Step LivePlan::next() {
  ++frames_;
  const auto group_end = [this](int64_t group) {
    return start_ + (solve_at_ - start_) * group / groups_;
  };
  Step step;
  if (frames_ < group_end(groups_done_ + 1)) return step;
  step.group = static_cast<int>(group_end(groups_done_ + 1) - group_end(groups_done_));
  ++groups_done_;
  step.solve = groups_done_ == groups_;
  if (step.solve) {
    start_ = solve_at_;
    // A window that is filling up is solved as it grows: its first frames say little.
    plan(start_ + std::clamp<int64_t>(frames_ / 2, 1, hop_size_));
  }
  const int64_t size = std::min<int64_t>(frames_, window_size_);
  const auto until_next = static_cast<int>(group_end(groups_done_ + 1) - frames_);
  // A hop of the warm-up may be a larger group, but there are no frames to spare for it.
  step.gram_slices = std::min({slices(size), until_next, largest_group()});
  if (step.solve) {
    const int most = in_one_piece() ? piece_frames_ : std::min(slices(size), kMostBuildSlices);
    step.build_slices = std::min(most, static_cast<int>(solve_at_ - start_));
  }
  return step;
}

}  // namespace qdmd
