// SPDX-License-Identifier: LGPL-2.1-or-later
// When the background learns from frames, and when frames may leave: batch and live differ in this.
#pragma once

#include <functional>
#include <utility>

#include "core/align/restorer.h"
#include "core/align/stabilizer.h"
#include "core/base/image_view.h"
#include "core/base/status.h"
#include "core/engine/background.h"
#include "core/engine/pace.h"
#include "core/foreground/enlarger.h"
#include "core/frames/frame_store.h"
#include "core/parallel/workers.h"

namespace qdmd {

// What a schedule works with; its engine owns all of it.
struct Stage {
  FrameStore* frames;
  Background* background;
  Workers* workers;
  Pace* pace;
  Clock* clock;
  // Where the camera may move; or null, both.
  Stabilizer* stabilizer = nullptr;
  Restorer* restorer = nullptr;
  // Where frames are larger than what is learnt of them; or null.
  Enlarger* enlarger = nullptr;
};

// Frames that were pushed and wait to be popped: the newest `pending` of the store. The oldest
// `ready` of them may leave, one after the other.
struct Queue {
  int pending = 0, ready = 0;
};

// Frames go in, and are ready with the background of their time. May throw std::bad_alloc; what
// waits is lost then, and flush() comes next.
class Schedule {
 public:
  explicit Schedule(const Stage& stage) : stage_(stage) {}
  virtual ~Schedule() = default;
  Schedule(const Schedule&) = delete;
  Schedule& operator=(const Schedule&) = delete;

  const Queue& queue() const { return queue_; }
  // In the store: the frame that leaves next, while one waits.
  int next_index() const { return frames().size() - queue_.pending; }

  // Takes a frame in. False: the frame has alpha for which there is no room (FrameStore::append).
  bool push(const ImageView& frame) {
    held_up_ = false;
    return take_in(frame);
  }
  // Work of a solve was done in the newest push(), or waited for.
  bool held_up() const { return held_up_; }
  // How often frames showed another scene than the background (Learner::scene_of), so
  // that learning began anew.
  uint64_t scenes() const { return scenes_; }
  // All that waits becomes ready. The next frame begins a new window.
  virtual void drain() = 0;
  // After drain(), when all frames have left: the next frame comes after the one before it, after
  // all.
  virtual void go_on() {}
  // Drops the work that is under way, and all frames, and forgets the background.
  void flush() {
    queue_ = {};
    restart();
    background().forget();
    pace().restart();
  }
  // What an earlier run learnt, of frames of this size, no solve being under way. No frame is lost.
  // Where it throws, all is as it was.
  virtual void learn_from(const Learnt& learnt) = 0;
  // Once for each frame that somebody wants pictures of, before show(): its background comes into
  // use, which may wait for a solve or do it, and is mended by what the frame shows.
  virtual void meet(int /*index*/) {}
  // Sets the model to the time, and the light, of frame `index` of the store.
  virtual void show(int index) = 0;
  // Sets it to those of the frame with which the newest background came.
  virtual void show_newest() = 0;
  // The next frame leaves, whether anybody asked for its pictures or not.
  void leave() {
    pass();
    --queue_.pending;
    --queue_.ready;
  }
  // There is no room in max-memory for frames before and after they were moved to the canvas: they
  // stay as they come.
  bool has_no_room() const { return no_room_; }
  // The next so many of the frames that wait leave with the background in use.
  virtual int frames_left() const = 0;

 protected:
  // See push(), flush() and leave().
  virtual bool take_in(const ImageView& frame) = 0;
  virtual void restart() = 0;
  virtual void pass() {}
  bool freeze() const { return background().wishes().freeze; }
  // Copies a frame in, and moves it to where the camera saw the background. False:
  // FrameStore::append.
  bool take(const ImageView& frame);
  // True where frames before the newest are compared with backgrounds to come.
  virtual bool holds_frames() const = 0;
  // Nothing that is known of the camera and its background holds for the next frame.
  void forget_camera() {
    if (stage_.stabilizer) stage_.stabilizer->forget();
    referred_to_ = 0;
  }
  Pool* idle_pool() const { return workers().idle_pool(); }

  FrameStore& frames() const { return *stage_.frames; }
  Background& background() const { return *stage_.background; }
  Workers& workers() const { return *stage_.workers; }
  Pace& pace() const { return *stage_.pace; }
  // Runs `work` beside the caller, where there is a thread for it. wait() comes before the next.
  void start(std::function<void()> work) {
    if (workers().start(std::move(work))) hold_up();
  }
  // For the side thread's work, whose time it charges itself. Throws what that threw.
  void wait() {
    const Clock::Span span = waiting();
    if (!workers().idle()) hold_up();
    workers().finish();
  }
  Clock::Span waiting() const { return Clock::Span(*stage_.clock, Clock::waiting); }
  // With the newest frame, which is taken in.
  SceneSeen scene_seen() {
    if (!background().known() || background().state() == Background::State::held)
      return SceneSeen::same;
    SceneSeen seen = background().learner().scene_of(frames().window().newest_slot());
    if (stage_.stabilizer && stage_.stabilizer->began_view())
      seen = SceneSeen::another;
    else if (stage_.stabilizer && seen != SceneSeen::same)
      stage_.stabilizer->begin_scene();
    scenes_ += seen == SceneSeen::another || seen == SceneSeen::the_one_before ? 1 : 0;
    return seen;
  }
  // For work of a solve that is done at once.
  void hold_up() { held_up_ = true; }

  Queue queue_;

 private:
  bool wants_reference(const Stabilizer& stabilizer);
  void move_canvas(const Pose& to);
  void steady(int index, const Pose& pose, Pool* pool);

  Stage stage_;
  bool held_up_ = false, no_room_ = false;
  uint64_t scenes_ = 0;
  uint64_t referred_to_ = 0;    // the solve that frames are compared with; 0: of none
  uint64_t solves_before_ = 0;  // with the frame before
  bool was_new_ = false;        // the frame before brought a new background
};

}  // namespace qdmd
