// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/stream_memory.h"

#include <algorithm>
#include <utility>

#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/thinning.h"

namespace qdmd {
void StreamMemory::begin() {
  const LearnerRoom& room = context_.room;
  earlier_ = left_ = EarlierWindow(context_.grid);
  frames_ = FrameMemory(WindowSolve::remembered_frames(context_, room.window_size, room.models),
                        context_.shape(), context_.grid);
}

// The earlier window: levels and spread, and the cells of it and of the scene that was left.
uint64_t StreamMemory::bytes(const RobustContext& context, int window_size, Models models) {
  return context.pixels() * (kChannels + 1) + 2 * GridFrames::bytes(context.grid, 1) +
         3 * context.grid.cells() * sizeof(float) +
         FrameMemory::bytes(WindowSolve::remembered_frames(context, window_size, models),
                            context.shape(), context.grid);
}

void StreamMemory::forget() {
  earlier_.forget();
  left_.forget();
  frames_.forget();
  stream_from_ = -1;
}

void StreamMemory::begin_scene(bool returns) {
  std::swap(earlier_, left_);
  if (!returns) earlier_.forget();
  frames_.forget();
  stream_from_ = -1;
}

void StreamMemory::recolour(const ColourMap& map) {
  if (!left_.known()) return;
  earlier_ = left_;
  earlier_.recolour(context_, map);
}

void StreamMemory::begin_from_here() {
  earlier_.forget();
  frames_.forget();
  stream_from_ = static_cast<int64_t>(context_.room.frames->frames_taken());
}

void StreamMemory::see(const SnapshotRange& window) {
  window_ = window;
  const uint64_t seen = context_.room.frames->frames_taken();
  fresh_ =
      std::min(1.0f, static_cast<float>(seen - frames_seen_) / static_cast<float>(window.size()));
  frames_seen_ = seen;
  if (stream_from_ < 0) stream_from_ = first_number();
}

void StreamMemory::take(const WindowSolve& solve, const GridFrames& cells, int at,
                        const SolveHistory& history) {
  if (context_.parameters.earlier_share > 0)
    earlier_.take(context_.grid, solve.reference(), solve.spread(), cells, at, solve.stable(),
                  solve.start_frames(), fresh_, history.held());
  keep_some(solve, history.disturbances());
}

// For windows to come.
void StreamMemory::keep_some(const WindowSolve& solve, const Disturbances& disturbances) {
  const int step =
      steps::memory::kStep * remembered_stride(context_.room.models, context_.room.window_size);
  for (int i = 0; i < window_->size(); ++i) {
    const int64_t number = first_number() + i;
    if (number < stream_from_ || (number - stream_from_) % step != 0) continue;
    if (number <= frames_.newest() || disturbances.has(number) || !solve.is_shown(number)) continue;
    window_->will_need(i);
    window_->will_need(i + step);
    frames_.keep(number, *window_, i, context_.room.frames->cells(),
                 int64_t{steps::memory::kWindows} * context_.room.window_size, context_.room.pool);
  }
}

}  // namespace qdmd
