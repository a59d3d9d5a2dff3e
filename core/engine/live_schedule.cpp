// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/live_schedule.h"

#include <algorithm>
#include <chrono>

namespace qdmd {
namespace {

using State = Background::State;
using Seconds = std::chrono::duration<double>;

}  // namespace

LiveSchedule::LiveSchedule(const Stage& stage, const LivePlan& plan)
    : Schedule(stage), plan_(plan) {}

bool LiveSchedule::take_in(const ImageView& frame) {
  const bool frozen = freeze() && background().known();
  const uint64_t solves = background().solves();
  if (frozen)
    pace().solve_next();
  else
    settle();
  if (frozen || start_new_window_) {
    const bool has_model = background().known();
    stop();
    if (has_model) {
      // What was loaded goes on to follow the light.
      const bool in_light = !frozen && background().state() == State::held_in_light;
      background().hold(time(), in_light ? State::held_in_light : State::held);
    }
    frames().clear();
    begin_window(has_model);
  }
  if (!take(frame)) return false;
  if (!frozen) follow_scene();
  if (!frozen) begin_work();
  if (background().state() != State::held)
    background().follow_light(frames().window().newest_slot());
  if (background().known()) see();
  if (background().solves() > solves) published_ = {time(), background().model().light(time())};
  pace().count_frame();
  queue_ = {1, 1};
  return true;
}

// With the newest frame: what was known of a scene is kept for its return.
void LiveSchedule::follow_scene() {
  const SceneSeen seen = scene_seen();
  if (seen == SceneSeen::same) return;
  stop();
  const bool returns = (seen == SceneSeen::the_one_before || seen == SceneSeen::earlier_colours) &&
                       left_.has_value();
  Learnt before;
  // In its own light: that of the newest frames is another scene's.
  show_newest();
  background().remember(&before);
  Learnt recoloured;
  if (seen == SceneSeen::other_colours) recoloured = before;
  const bool goes_on =
      seen == SceneSeen::other_colours && background().learner().recolour(&recoloured);
  if (returns || goes_on)
    background().return_to(goes_on ? recoloured : *left_, seen != SceneSeen::the_one_before);
  else
    background().begin_scene_at_once();
  left_ = std::move(before);
  begin_window(returns || goes_on);
}

// With the newest frame: what it shows is known, and the background is mended, but for one that was
// loaded.
void LiveSchedule::see() {
  const int count = std::min(frames().size(), Learner::kMendingFrames);
  const Learner::Compared frame = {SnapshotRange(frames().window()).newest(count), count - 1,
                                   static_cast<int64_t>(frames().frames_taken()) - 1, time(), true};
  if (background().state() == State::learnt)
    background().mend(frame);
  else if (background().state() == State::held_in_light)
    background().look_ahead(frame, false);
}

// Publishes what is due.
void LiveSchedule::settle() {
  if (piece_ && plan_.frames() + 1 < piece_->due) {
    wait_for_share();
    return;
  }
  wait();
  if (piece_) seconds_of_estimate_ = Seconds(workers().done()).count() / piece_->estimate;
  piece_.reset();
  publish();
}

void LiveSchedule::wait_for_share() {
  const Clock::Span span = waiting();
  // No solve is exactly as much work as the one before: the frame that it is due with does not wait
  // for what is more.
  const auto frames = plan_.frames() + 1 - piece_->from, all = piece_->due - piece_->from;
  const double share = 1.25 * static_cast<double>(frames) / static_cast<double>(all);
  const Seconds work(share * seconds_of_estimate_ * piece_->estimate);
  workers().help_until_done(std::chrono::duration_cast<Pool::Time::duration>(work));
}

void LiveSchedule::publish() {
  if (!finished_) return;
  model_start_ = *finished_;
  finished_.reset();
  background().publish();
}

// What comes with the newest frame.
void LiveSchedule::begin_work() {
  LivePlan::Step step = plan_.next();
  const bool first = !background().known();
  if (step.solve)
    step.solve = pace().next_stretch(&background(), background().learner().enough()) || first;
  const bool at_once = plan_.at_once() || first;
  // Frames that are kept for a solve in progress are no part of the window.
  const int size =
      static_cast<int>(std::min<int64_t>({plan_.frames(), plan_.window_size(), frames().size()}));
  const SnapshotRange span = SnapshotRange(frames().window()).newest(size);
  const int64_t first_frame = plan_.frames() - size;
  if (plan_.in_one_piece()) {
    if (!step.solve) return;
    background().begin(span);
    build_ = Build{1, 0, first_frame};
    if (!at_once)
      piece_ = Piece{plan_.frames(), plan_.frames() + step.build_slices,
                     background().learner().solve_seconds(size, Models::two_of_live)};
  } else if (step.group > 0) {
    group_ = GramGroup{span,       step.group,        step.gram_slices, 0,
                       step.solve, step.build_slices, first_frame};
  }
  if (group_ || build_) run(at_once);
}

void LiveSchedule::run(bool at_once) {
  wishes_ = background().wishes();
  if (!at_once) {
    start([this] { work(); });
    return;
  }
  while (group_ || build_) work();
  publish();
}

// One frame's share. Pictures come first: the solve after them needs their place.
void LiveSchedule::work() {
  if (build_) {
    background().build({build_->done, build_->slices});
    if (++build_->done == build_->slices) {
      background().finish(wishes_);
      finished_ = build_->first_frame;
      build_.reset();
    }
  }
  if (group_) {
    background().learner().add(group_->span, group_->frames, {group_->done, group_->slices});
    if (++group_->done < group_->slices) return;
    if (group_->solve) {
      background().begin(group_->span);
      build_ = Build{group_->build_slices, 0, group_->first_frame};
    }
    group_.reset();
  }
}

void LiveSchedule::drain() {
  queue_.ready = queue_.pending;
  start_new_window_ = true;
}

void LiveSchedule::stop() noexcept {
  workers().abandon();
  group_.reset();
  build_.reset();
  piece_.reset();
  finished_.reset();
}

// The first solve comes with its first frame, or, where there is a model, after a hop: a model of
// many frames is better than one of few.
void LiveSchedule::begin_window(bool has_model) {
  plan_.restart(has_model ? plan_.hop_size() : 1);
  start_new_window_ = false;
}

void LiveSchedule::restart() {
  forget_camera();
  stop();
  left_.reset();
  frames().clear();
  begin_window(false);
}

// What is under way is about other frames: the next one begins a new window.
void LiveSchedule::learn_from(const Learnt& learnt) {
  background().make_room();
  background().recall(learnt);
  stop();
  background().show(learnt,
                    background().learner().follows_light() ? State::held_in_light : State::held);
  pace().solve_next();
  start_new_window_ = true;
}

// The newest frame's time in the model in use. Where the light is followed, it ends with the
// model's window; else, where solves are left out, with the frames for which the plan has the
// model: a mode does not go on to grow or fade.
double LiveSchedule::time() const {
  int last = background().report().window_frames - 1;
  if (!background().learner().follows_light()) last += plan_.hop_size() + plan_.most_late_frames();
  return static_cast<double>(std::min<int64_t>(plan_.frames() - 1 - model_start_, last));
}

void LiveSchedule::show(int index) {
  if (background().state() != State::held) background().follow_light(frames().slot(index));
  background().model().set_time(time());
}

void LiveSchedule::show_newest() {
  BackgroundModel& model = background().model();
  if (background().state() == State::learnt && background().learner().follows_light())
    model.set_light(published_.light);
  if (background().state() == State::held_in_light) model.set_light(kSameLight);
  model.set_time(published_.time);
}

}  // namespace qdmd
