// SPDX-License-Identifier: LGPL-2.1-or-later
// Q-DMD and exact DMD of a window, from its exact Gram matrix.
#pragma once

#include <optional>

#include "core/dmd/decompose.h"
#include "core/gram/gram.h"
#include "core/learn/learner.h"

namespace qdmd {

// Methods qdmd and dmd: the inner products of frames as they come, then the paper's Algorithm 2 or
// 1 on their Gram matrix, then the modes' pictures.
class GramLearner : public Learner {
 public:
  GramLearner(const LearnOptions& options, int width, int height);

  FrameContents contents() const override;
  std::vector<int> sample_steps() const override { return {step_}; }
  bool in_one_piece() const override { return false; }
  uint64_t bytes(int window_size, int capacity, Models models, int threads) const override;
  bool may_read_frames(int window_size) const override;
  double solve_seconds(int window_size, Models models) const override;
  uint64_t solver_bytes(int window_size) const override;

  void begin(const LearnerRoom& room) override;
  void add(const SnapshotRange& span, int frames, Slice slice) override;
  void decompose(const SnapshotRange& snapshots) override;
  void build(Slice slice, BackgroundModel* model) override;
  SolveFacts facts() const override { return built_; }

 private:
  bool keeps_shared() const;
  bool shares_chroma() const;
  // What the decomposition sees of them.
  SnapshotRange columns_of(const SnapshotRange& snapshots) const;
  struct Lines {
    size_t first, count;
  };
  Lines lines_of(const SnapshotRange& columns, Slice slice) const;
  void add_lines(const SnapshotRange& columns, int frames, Lines lines);
  void add_in_parts(const SnapshotRange& columns, int frames, Slice slice);
  double pixels_seen() const;

  LearnOptions options_;
  int width_, height_, step_;
  LearnerRoom room_ = {};
  SlidingGram gram_;
  double products_told_ = 0;  // seconds of Clock::products that earlier solves have told of
  // What the newest decompose() used and found.
  std::optional<SnapshotRange> snapshots_;
  TemporalModel background_;
  SolveFacts decomposed_, built_;
};

}  // namespace qdmd
