// SPDX-License-Identifier: LGPL-2.1-or-later
// One frame leaves for each that comes, against its own window's model.
#pragma once

#include <cstdint>
#include <optional>

#include "core/engine/schedule.h"

namespace qdmd {

// A window is collected. Its frames enter the Gram matrix in groups, while further frames come. The
// window's last frame begins the solve, which must end `late_frames` frames later (0: it is done at
// once). From then on a frame of the window leaves with each frame that comes, while the next
// window is collected. So a frame waits for window_size - 1 + late_frames others, whatever time a
// solve takes. Whether the background is held is decided when a window begins; frames of such a
// window wait as long. drain() solves an unfinished window together with as many frames before it
// as make it whole.
class BatchSchedule : public Schedule {
 public:
  // late_frames < window_size.
  BatchSchedule(const Stage& stage, int window_size, int late_frames);

  void drain() override;
  void go_on() override { break_ = false; }
  void learn_from(const Learnt& learnt) override;
  void meet(int index) override;
  void show(int index) override;
  void show_newest() override;
  int frames_left() const override;

 protected:
  bool take_in(const ImageView& frame) override;
  void restart() override;
  void pass() override;

 private:
  // Frames [begin, end) that leave with one background, by their numbers in the store.
  struct Stretch {
    int64_t begin = 0, end = 0;
    int64_t time_zero = 0;  // the first snapshot of its model
    Background::State state = Background::State::learnt;
    int64_t hold_from = INT64_MAX;  // frames that its window does not have
    bool begins_scene = false;      // it is another scene than what was shown before
  };
  // The one that is collected.
  struct Collection {
    int64_t begin = 0;
    bool freeze = false;
    bool decided = false;  // what its state is
    Background::State state = Background::State::learnt;
    int not_added = 0;                  // newest frames whose inner products are not computed yet
    std::optional<int64_t> scene = {};  // the first frame of another scene
    bool scene_returns = false;         // which was left before
    bool other_colours = false;         // of the same places
  };
  // Shown by the first window from frame `from` on, if that one is held.
  struct Loaded {
    Learnt learnt;
    int64_t from;
  };
  // The side thread's.
  struct Work {
    SnapshotRange span;
    int fresh;  // newest frames that enter the Gram matrix
    Wishes wishes = {};
  };

  // Frames of an earlier window are not known to be moved: they have their background.
  bool holds_frames() const override {
    return collection_ && collection_->begin + frames().size() == taken();
  }
  int64_t taken() const { return static_cast<int64_t>(frames().frames_taken()); }
  int64_t kept_from() const { return taken() - frames().size(); }
  int collected() const { return collection_ ? static_cast<int>(taken() - collection_->begin) : 0; }
  int64_t next_to_leave() const { return taken() - queue_.pending; }
  double time_of(int64_t frame) const { return static_cast<double>(frame - shown_.time_zero); }

  void look_ahead();
  void follow_scene();
  void begin_with(int64_t frame);
  void begin_stream();
  void decide();
  void add_group();
  void end_window(bool at_once);
  void begin_scene(const Collection& window);
  void end_early();
  void solve();
  void solve_at_once();
  void advance();

  int window_size_, late_frames_;
  bool break_ = false;        // the next frame begins a new stream
  int64_t history_from_ = 0;  // frames from there on may be in one model
  Stretch shown_;             // with the background in use
  std::optional<Stretch> waiting_;
  std::optional<Collection> collection_;
  std::optional<Loaded> loaded_;
  // Another scene, or a disturbance, that a window before ended in.
  struct SceneStart {
    int64_t frame;
    bool other_colours;
  };
  std::optional<SceneStart> scene_from_;
  std::optional<Work> work_;
  bool put_off_ = false;  // until the window's first frame leaves
};

}  // namespace qdmd
