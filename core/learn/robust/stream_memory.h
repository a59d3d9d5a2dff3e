// SPDX-License-Identifier: LGPL-2.1-or-later
// What windows leave to the windows after them, scene by scene.
#pragma once

#include <optional>

#include "core/learn/robust/colour_map.h"
#include "core/learn/robust/earlier_window.h"
#include "core/learn/robust/frame_memory.h"
#include "core/learn/robust/window_solve.h"

namespace qdmd {

class StreamMemory {
 public:
  explicit StreamMemory(const RobustContext& context) : context_(context) {}
  // Takes all memory.
  void begin();
  static uint64_t bytes(const RobustContext& context, int window_size, Models models);

  void forget();
  // What was known of the scene is kept for its return. returns: the scene that was left last is
  // back, and what was known of it is known again.
  void begin_scene(bool returns);
  // Nothing that frames have shown until now is remembered.
  void begin_from_here();
  // The scene that was left goes on in other colours.
  void recolour(const ColourMap& map);
  // The window of the next solve: the newest frames.
  void see(const SnapshotRange& window);
  // The number of its first frame, counted like FrameStore::frames_taken().
  int64_t first_number() const { return static_cast<int64_t>(frames_seen_) - window_->size(); }
  // After its solve. cells: the background's are picture `at` of them. history: what the solve was
  // told.
  void take(const WindowSolve& solve, const GridFrames& cells, int at, const SolveHistory& history);

  EarlierWindow* earlier() { return &earlier_; }
  const EarlierWindow& earlier() const { return earlier_; }
  FrameMemory* frames() { return &frames_; }

 private:
  void keep_some(const WindowSolve& solve, const Disturbances& disturbances);

  const RobustContext& context_;
  EarlierWindow earlier_, left_;  // of the scene, and of the one that was left
  FrameMemory frames_;
  std::optional<SnapshotRange> window_;
  float fresh_ = 1;           // the share of it that no window before had
  int64_t stream_from_ = -1;  // the first frame since forget(); -1: no window was seen
  uint64_t frames_seen_ = 0;  // that the store had taken by then
};

}  // namespace qdmd
