// SPDX-License-Identifier: LGPL-2.1-or-later
// Each frame leaves at once, against the newest model.
#pragma once

#include <optional>

#include "core/engine/live_plan.h"
#include "core/engine/schedule.h"

namespace qdmd {

// The work that the plan has for a frame runs on the side thread until the next frame comes. It is
// done at once if it is little work, or if there is no model yet. A solve in one piece goes on over
// several frames. So models are published at fixed frames. After a break the background is held
// until there is a new model.
class LiveSchedule : public Schedule {
 public:
  LiveSchedule(const Stage& stage, const LivePlan& plan);

  void drain() override;
  void learn_from(const Learnt& learnt) override;
  void show(int index) override;
  void show_newest() override;
  int frames_left() const override { return queue_.pending; }

 protected:
  bool take_in(const ImageView& frame) override;
  void restart() override;

 private:
  // A group of frames on its way into the Gram matrix.
  struct GramGroup {
    SnapshotRange span;
    int frames, slices, done = 0;
    bool solve;
    int build_slices;
    int64_t first_frame;  // of the span, counted from the plan's restart
  };
  // Pictures of modes in the making.
  struct Build {
    int slices, done = 0;
    int64_t first_frame;
  };

  // A solve in one piece: it goes on beside the frames until frame `due`, before which it must end.
  // If only that frame waited, it could wait long. So each frame helps until its share of the work
  // is done, which is taken to be as much as the last solve was.
  struct Piece {
    int64_t from, due;
    double estimate;  // Learner::solve_seconds()
  };

  // What the model is set to for a frame.
  struct Moment {
    double time = 0;
    Gain light = kSameLight;
  };

  bool holds_frames() const override { return false; }
  void follow_scene();
  void see();
  void settle();
  void wait_for_share();
  void begin_work();
  void run(bool at_once);
  void work();
  void publish();
  void stop() noexcept;
  void begin_window(bool has_model);
  double time() const;

  LivePlan plan_;
  bool start_new_window_ = false;
  Moment published_;         // when the model in use was published
  int64_t model_start_ = 0;  // the frame at time 0 of the model in use, counted like first_frame
  std::optional<Piece> piece_;
  double seconds_of_estimate_ = 0;  // that threads worked in the last piece, for each estimated one
  // The side thread's while it works.
  std::optional<GramGroup> group_;
  std::optional<Build> build_;
  std::optional<int64_t> finished_;  // first frame of a solve that waits to be published
  Wishes wishes_;                    // as they were when the work began
  std::optional<Learnt> left_;       // of the scene that the camera showed before
};

}  // namespace qdmd
