// SPDX-License-Identifier: LGPL-2.1-or-later
// Robust Q-DMD: the background modes of a window whose foreground was taken out.
#pragma once

#include <vector>

#include "core/learn/learner.h"
#include "core/learn/robust/frame_follower.h"
#include "core/learn/robust/stream_memory.h"
#include "core/learn/robust/window_solve.h"

namespace qdmd {

// The paper ends with the wish to combine Q-DMD with sparse methods; this is such a combination.
//   start    for each region the frames that show its background (find_stable_frames), and their
//            median: a background picture and its spread
//   repeat   what differs from the picture is foreground (find_mask) and becomes background
//            (Filler); Q-DMD of the filled window, of rank 1 unless another is asked for, with
//            amplitudes fitted to all frames, is the next background
// Where samples have more than 8 bits, the start, masks and inner products see the highest eight;
// what is filled and combined last has all bits.
// Global changes of light are divided out before and put back in L(t). Inner products are taken
// from sampled pixels, exactly; the pictures of the modes are combined from all.
class RobustLearner : public Learner {
 public:
  RobustLearner(const LearnOptions& options, int width, int height,
                const RobustParameters& parameters = {});

  FrameContents contents() const override { return context_.contents(); }
  std::vector<int> sample_steps() const override;
  bool in_one_piece() const override { return true; }
  uint64_t bytes(int window_size, int capacity, Models models, int threads) const override;
  bool may_read_frames(int) const override { return false; }
  uint64_t bytes_to_unshare() const override;
  double solve_seconds(int window_size, Models models) const override;
  uint64_t solver_bytes(int window_size) const override;

  void begin(const LearnerRoom& room) override;
  void forget() override;
  void remember(Learnt* learnt) const override;
  void recall(const Learnt& learnt) override;
  bool makes_limits() const override { return true; }
  void set_sample_step(int step) override;
  void add(const SnapshotRange&, int, Slice) override {}
  void decompose(const SnapshotRange& snapshots) override;
  void build(Slice slice, BackgroundModel* model) override;
  SolveFacts facts() const override { return facts_; }
  int enough() const override { return follower_.enough(); }
  void publish() override;

  void mend(const Compared& frame, BackgroundModel* model) override {
    follower_.mend(frame, model);
  }
  void look_ahead(const Compared& frame, BackgroundModel* model) override {
    follower_.look_ahead(frame, model);
  }
  UncoveredPlaces* uncovered() override { return follower_.uncovered(); }
  void set_absorb_frames(int64_t frames) override { follower_.set_absorb_frames(frames); }

  SceneSeen scene_of(int slot) override { return follower_.scene_of(slot); }
  void begin_scene(bool returns) override;
  bool recolour(Learnt* learnt) const override;

  bool follows_light() const override { return true; }
  void follow(const std::vector<uint8_t> level[kChannels]) override { follower_.follow(level); }
  Gain light(int slot) override { return follower_.light(slot); }

 private:
  RobustContext context_;
  StreamMemory memory_;
  SolveHistory history_;
  WindowSolve solve_;
  FrameFollower follower_;
  // Of the newest solve.
  std::optional<SnapshotRange> window_;
  bool settled_ = false;
  SolveFacts facts_;
};

}  // namespace qdmd
