// SPDX-License-Identifier: LGPL-2.1-or-later
// What an engine's options and a size of frames come to, and why they are refused.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "core/base/reduction.h"
#include "core/base/status.h"
#include "core/engine/engine_options.h"
#include "core/engine/live_plan.h"
#include "core/model/learnt.h"

namespace qdmd {

// Frames and bytes.
struct EngineLayout {
  int delay = 0;        // frames that a frame waits for: batch: window_size - 1 and late_frames
  int late_frames = 0;  // frames that arrive while a window is solved and is still needed
  int capacity = 0;     // frames that are kept
  int sample_step = 1;
  uint64_t frame_bytes = 0;  // of the planes of the frames that are kept, in memory or on disk
  uint64_t store_bytes = 0;  // of these, if in memory, and of all that belongs to a frame
  uint64_t soft_bytes = 0;   // of soft masks
  uint64_t bytes = 0;        // of these and of all else that is taken, at most at once
};

// Worked out once, before anything is taken for frames.
class EnginePlan {
 public:
  EnginePlan() = default;
  EnginePlan(const EngineOptions& options, int width, int height);

  // Not ok: no engine can be configured so, and what is said below holds as far as it is known.
  const Status& status() const { return status_; }
  const EngineOptions& options() const { return options_; }
  // Of the frames, and of the picture that is learnt.
  const Reduction& size() const { return size_; }
  // Bytes are UINT64_MAX, and the rest is nothing, where there are too many pixels.
  const EngineLayout& layout() const { return layout_; }
  Models models() const { return models_; }
  // When work is done in live mode.
  const LivePlan& live() const { return live_; }
  // The learner, whose first caller gets it.
  std::unique_ptr<Learner> take_learner() { return std::move(learner_); }
  // What is wished of the frames, for the picture that is learnt.
  Wishes wishes_of(Wishes wishes) const;

  // Ok if frames of this size may have that background.
  Status may_learn_from(const Learnt& learnt) const;
  // Why frames whose alpha varies are refused, with which the store takes so many bytes.
  Status alpha_refused(uint64_t store_bytes) const;

 private:
  Status check_memory() const;
  // What windows of so many frames take at least, however small frames are.
  uint64_t bytes_of_any_size() const;
  EngineLayout layout_with(int late_frames) const;

  EngineOptions options_;
  Reduction size_;
  Status status_;
  std::unique_ptr<Learner> learner_;
  LivePlan live_;
  EngineLayout layout_;
  Models models_ = Models::one;
};

}  // namespace qdmd
