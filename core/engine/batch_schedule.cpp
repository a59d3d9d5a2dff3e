#include "core/engine/batch_schedule.h"

#include <algorithm>
#include <utility>

namespace qdmd {
namespace {

// Frames that enter the Gram matrix together: few enough that little is left to do when a window is
// full, enough that they fill a register tile and the window is not read from memory for each of
// them.
constexpr int kGroup = 16;

}  // namespace

bool BatchSchedule::push(const ImageView& frame, bool freeze, Queue* queue) {
  if (queue->pending == 0) begin_window(freeze);
  if (start_new_window_) {
    wait();
    frames().clear();
    not_added_ = 0;
    start_new_window_ = false;
  }
  if (!frames().append(frame)) return false;
  ++queue->pending;
  pace().count_frame();
  // Frames of the window before are left out: they count only if this window ends early.
  if (++not_added_ == std::min(kGroup, window_size_) &&
      background().state() == Background::State::learnt)
    add_group(SnapshotRange(frames().window()).newest(queue->pending));
  if (queue->pending == window_size_) solve(queue);
  return true;
}

void BatchSchedule::begin_window(bool freeze) {
  using State = Background::State;
  const bool solves = pace().next_stretch(&background());
  // After a freeze, the next window is solved.
  if (freeze) pace().solve_next();
  if (!background().known()) return;
  const double last = frames().size() - 1;
  if (freeze || !solves) {
    background().hold(last, freeze ? State::held : State::held_in_light);
    // Until the first of its frames is shown.
    if (!freeze && frames().size() > 0) background().follow_light(frames().window().newest_slot());
  } else if (background().state() != State::learnt) {
    background().learn();
    // Frames that came meanwhile are in no Gram matrix.
    start_new_window_ = true;
  } else if (background().model().reads_snapshots()) {
    // They are about to make room for others; somebody may still ask for this background.
    background().model().freeze_at(last);
  }
}

// Goes on beside the frames that follow.
void BatchSchedule::add_group(const SnapshotRange& span) {
  wait();
  group_ = Group{span, std::exchange(not_added_, 0)};
  // What a std::function holds without memory of its own.
  side().start([this] { background().learner().add(group_->span, group_->frames, {}); });
}

// A model for the window as it is.
void BatchSchedule::solve(Queue* queue) {
  queue->ready = queue->pending;
  const int not_added = std::exchange(not_added_, 0);
  if (background().state() != Background::State::learnt) return;
  wait();
  const SnapshotRange window(frames().window());
  const int fresh = queue->pending < window.size() ? queue->pending : not_added;
  if (fresh > 0) background().learner().add(window, fresh, {});
  background().begin(window);
  background().build({});
  background().finish(background().fixed_threshold());
  background().publish();
}

void BatchSchedule::drain(Queue* queue) {
  if (queue->pending > queue->ready) solve(queue);
  start_new_window_ = true;
}

void BatchSchedule::restart() {
  side().abandon();
  frames().clear();
  not_added_ = 0;
  start_new_window_ = false;
}

void BatchSchedule::show(int index) {
  if (background().state() == Background::State::held_in_light)
    background().follow_light(frames().slot(index));
  background().model().set_time(index);
}

void BatchSchedule::show_newest() {
  background().model().set_time(background().report().window_frames - 1);
}

}  // namespace qdmd
