// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/batch_schedule.h"

#include <algorithm>
#include <utility>

namespace qdmd {
namespace {

using State = Background::State;

// Frames that enter the Gram matrix together: few enough that little is left to do when a window is
// full, enough that they fill a register tile and the window is not read from memory for each of
// them. From a disk the window is read once, for all of them.
constexpr int kGroup = 16;

}  // namespace

BatchSchedule::BatchSchedule(const Stage& stage, int window_size, int late_frames)
    : Schedule(stage), window_size_(window_size), late_frames_(late_frames) {}

bool BatchSchedule::take_in(const ImageView& frame) {
  if (queue_.pending == 0) begin_stream();
  if (!collection_) {
    collection_ = Collection{taken(), freeze()};
    if (const auto from = std::exchange(scene_from_, std::nullopt)) {
      collection_->scene = from->frame;
      collection_->other_colours = from->other_colours;
    }
    if (!waiting_) decide();
  }
  if (!take(frame)) return false;
  ++queue_.pending;
  ++collection_->not_added;
  if (!collection_->freeze) follow_scene();
  pace().count_frame();
  if (collected() == window_size_) {
    end_window(late_frames_ == 0);
  } else if (!waiting_ && collection_->state == State::learnt &&
             collection_->not_added >= std::min(kGroup, window_size_) &&
             !frames().window().on_disk()) {
    add_group();
  }
  if (queue_.pending >= window_size_ + late_frames_) {
    queue_.ready = 1;
    if (next_to_leave() == shown_.end) advance();
  }
  look_ahead();
  return true;
}

// With the newest frame.
void BatchSchedule::follow_scene() {
  Collection& window = *collection_;
  const SceneSeen seen = scene_seen();
  switch (seen) {
    case SceneSeen::same:
      // It was no disturbance: all frames that show it have the background of this window.
      if (window.scene && *window.scene < window.begin &&
          taken() - *window.scene >= steps::scene::kLasts)
        begin_with(*window.scene);
      return;
    case SceneSeen::another:
      window.scene = std::max(window.begin, taken() - Learner::kSceneFrames);
      window.scene_returns = window.other_colours = false;
      return;
    case SceneSeen::other_colours:
    case SceneSeen::earlier_colours:
      if (!window.scene) window.scene = std::max(window.begin, taken() - steps::colour::kFrames);
      window.scene_returns = seen == SceneSeen::earlier_colours;
      window.other_colours = true;
      return;
    case SceneSeen::the_one_before:
      // Something disturbed the picture for a moment.
      if (window.scene && !window.scene_returns)
        window.scene.reset();
      else if (!window.scene)
        window.scene = std::max(window.begin, taken() - steps::scene::kReturn);
      window.scene_returns = true;
      window.other_colours = false;
      return;
  }
}

// The window that is collected gets the last frames of the one before, which still wait.
void BatchSchedule::begin_with(int64_t frame) {
  Collection& window = *collection_;
  Stretch& before = waiting_ ? *waiting_ : shown_;
  if (frame > before.begin && frame > next_to_leave())
    before.end = window.begin = frame;
  else
    window.scene = window.begin;
}

// With the newest frame: it may show what is behind the background of those that wait.
void BatchSchedule::look_ahead() {
  const int count = std::min(frames().size(), Learner::kMendingFrames);
  const int64_t next = next_to_leave();
  // What somebody is about to hold, or what was loaded, stays as it is.
  const auto learns = [](const auto& window) { return !window || window->state == State::learnt; };
  const bool used = next < shown_.end && !freeze() && !loaded_ && learns(waiting_) &&
                    learns(collection_) &&
                    !(collection_ && (collection_->freeze || collection_->scene)) &&
                    !(waiting_ && waiting_->begins_scene);
  background().look_ahead(
      {SnapshotRange(frames().window()).newest(count), count - 1, taken() - 1, time_of(next)},
      used);
}

// No frame waits.
void BatchSchedule::begin_stream() {
  if (background().known() && background().model().reads_snapshots()) {
    // They are about to make room for others; somebody may still ask for this background.
    background().model().freeze_at(background().report().window_frames - 1);
  }
  if (!std::exchange(break_, false)) return;
  wait();
  frames().clear();
  history_from_ = taken();
}

// What becomes of the window that is collected: once the background before it is in use.
void BatchSchedule::decide() {
  Collection& window = *collection_;
  window.decided = true;
  const bool solves = pace().next_stretch(&background());
  // After a freeze, the next window is solved.
  if (window.freeze) pace().solve_next();
  if (!background().known()) return;
  if (window.freeze)
    window.state = State::held;
  else if (!solves)
    window.state = State::held_in_light;
  else if (background().state() != State::learnt)
    // Frames that came meanwhile are in no Gram matrix.
    history_from_ = window.begin;
}

// Goes on beside the frames that follow. Frames of the window before are left out: they count only
// if this window ends early.
void BatchSchedule::add_group() {
  wait();
  const SnapshotRange span = SnapshotRange(frames().window()).newest(collected());
  work_ = Work{span, std::exchange(collection_->not_added, 0)};
  // What a std::function holds without memory of its own.
  start([this] { background().learner().add(work_->span, work_->fresh, {}); });
}

// The window that is collected waits from now on, and is solved.
void BatchSchedule::end_window(bool at_once) {
  Collection window = *std::exchange(collection_, std::nullopt);
  // It may be a disturbance, which the next window will know, if that is long enough.
  if (window.scene && !window.scene_returns && !break_ &&
      taken() - *window.scene < steps::scene::kLasts) {
    scene_from_ = SceneStart{*window.scene, window.other_colours};
    window.scene.reset();
  }
  if (window.scene && *window.scene < window.begin) window.scene = window.begin;
  waiting_ =
      Stretch{window.begin, taken(), window.begin, window.scene ? State::learnt : window.state};
  waiting_->begins_scene = window.scene.has_value();
  if (window.scene) begin_scene(window);
  if (waiting_->state != State::learnt) return;
  wait();
  const auto count = static_cast<int>(taken() - window.begin);
  const int64_t from = window.scene ? *window.scene : std::min(history_from_, window.begin);
  const int size =
      static_cast<int>(std::min<int64_t>({window_size_, frames().size(), taken() - from}));
  const SnapshotRange span = SnapshotRange(frames().window()).newest(size);
  waiting_->time_zero = taken() - size;
  // Nothing is wanted of frames before another scene.
  work_ =
      Work{span, count < size ? count : std::min(window.not_added, size), background().wishes()};
  // Reads how many frames there are.
  if (background().learner().in_one_piece()) background().begin(span);
  // Frames that leave before it need the model whose place it takes.
  put_off_ = at_once && shown_.end > window.begin;
  if (put_off_) return;
  if (at_once)
    solve_at_once();
  else
    start([this] { solve(); });
}

void BatchSchedule::solve_at_once() {
  hold_up();
  solve();
}

// Frames before it leave with the background before; what comes after knows nothing of them.
void BatchSchedule::begin_scene(const Collection& window) {
  wait();
  background().begin_scene(window.scene_returns, window.other_colours);
  history_from_ = *window.scene;
  if (shown_.end != window.begin) return;
  shown_.hold_from = window.begin;
  shown_.end = waiting_->begin = *window.scene;
}

void BatchSchedule::solve() {
  if (work_->fresh > 0) background().learner().add(work_->span, work_->fresh, {});
  if (!background().learner().in_one_piece()) background().begin(work_->span);
  background().build({});
  background().finish(work_->wishes);
}

// The last frame of a window has left: the background of the next comes into use.
void BatchSchedule::advance() {
  // It is that of a window that ended early.
  if (!waiting_) end_window(true);
  const Stretch next = *waiting_;
  if (next.state == State::learnt) {
    wait();
    if (std::exchange(put_off_, false)) solve_at_once();
    background().publish();
  } else if (loaded_ && next.begin >= loaded_->from) {
    wait();
    background().show(loaded_->learnt, next.state);
  } else {
    background().hold(background().report().window_frames - 1, next.state);
  }
  if (loaded_ && next.begin >= loaded_->from) loaded_.reset();
  shown_ = next;
  waiting_.reset();
  if (!collection_) return;
  if (!collection_->decided) decide();
  if (break_) end_early();
}

// No more frames come to the window that is collected: it is solved beside those that leave before
// it, where there is a place for its model.
void BatchSchedule::end_early() {
  if (collection_ && !waiting_ && late_frames_ > 0) end_window(false);
}

void BatchSchedule::drain() {
  break_ = true;
  if (queue_.pending == 0) return;
  queue_.ready = queue_.pending;
  end_early();
  if (next_to_leave() == shown_.end) advance();
}

void BatchSchedule::restart() {
  forget_camera();
  workers().abandon();
  frames().clear();
  waiting_.reset();
  collection_.reset();
  loaded_.reset();
  scene_from_.reset();
  break_ = put_off_ = false;
  history_from_ = taken();
  shown_ = {taken(), taken(), taken()};
}

// Frames that wait have their background, or their window is about to be solved.
void BatchSchedule::learn_from(const Learnt& learnt) {
  const bool shown = !background().known() || queue_.pending == 0;
  std::optional<Loaded> loaded;
  if (shown) background().make_room();
  if (queue_.pending > 0) {
    loaded = Loaded{learnt, taken()};
    // Others are told of that.
    loaded->learnt.earlier.reset();
  }
  background().recall(learnt);
  if (shown) background().show(learnt, State::held);
  loaded_ = std::move(loaded);
}

// Windows come one after the other, also where nobody looks at a window's first frame.
void BatchSchedule::pass() {
  if (next_to_leave() == shown_.end) advance();
}

void BatchSchedule::meet(int index) {
  const int64_t frame = kept_from() + index;
  if (frame == shown_.end) advance();
  if (background().state() != State::learnt) return;
  if (frame >= shown_.hold_from) {
    background().hold(background().report().window_frames - 1, State::held_in_light);
    return;
  }
  const int count = std::min(frames().size() - index, Learner::kMendingFrames);
  background().mend({{frames().window(), index, count}, 0, frame, time_of(frame)});
}

void BatchSchedule::show(int index) {
  if (background().state() == State::held_in_light) background().follow_light(frames().slot(index));
  background().model().set_time(time_of(kept_from() + index));
}

void BatchSchedule::show_newest() {
  background().model().set_time(background().report().window_frames - 1);
}

int BatchSchedule::frames_left() const {
  return static_cast<int>(std::max<int64_t>(0, shown_.end - next_to_leave()));
}

}  // namespace qdmd
