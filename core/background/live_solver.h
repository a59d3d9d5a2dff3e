// Runs a WindowSolver beside the frames of a live stream.
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "core/background/live_schedule.h"
#include "core/background/window_solver.h"
#include "core/parallel/side_thread.h"

namespace qdmd {

// Before a frame enters the window: settle(). After that: start(). What LiveSchedule has for the
// frame then runs on the side thread until the next settle(), or at once where it is little or
// where there is no model yet. A solve in one piece (LiveSchedule) goes on over several frames.
// Models are therefore published at fixed frames.
class LiveSolver {
 public:
  LiveSolver() = default;
  // `solver` and `side` outlive this.
  LiveSolver(const LiveSchedule& schedule, WindowSolver* solver, SideThread* side)
      : schedule_(schedule), solver_(solver), side_(side) {}

  // The next frame is the first of an empty window. The first solve comes with it, or, where
  // `has_model`, after a hop: a model of many frames is better than one of few.
  void restart(bool has_model);
  // True: a model was published. Throws what the work threw.
  bool settle();
  // Begins the work that comes with the newest frame of `window`. `at_once`: ends it, too. True: a
  // model was published. fixed_threshold: for the foreground's statistics. solve_now: asked before
  // each solve that the schedule has; where it says no, there is none.
  bool start(const Window& window, double fixed_threshold, bool at_once,
             const std::function<bool()>& solve_now);
  // Drops the work that is under way.
  void stop();

  // Seconds of work since the last call, with the Gram matrix and with solves. While nothing is
  // under way.
  double take_gram_seconds() { return std::exchange(gram_seconds_, 0.0); }
  double take_solve_seconds() { return std::exchange(solve_seconds_, 0.0); }
  // Seconds in which settle() waited for such work, or start() did it, since the last call.
  double take_wait_seconds() { return std::exchange(wait_seconds_, 0.0); }

  // The newest frame's time in the published model. Where the light is followed, it ends with the
  // model's window; else, where solves are left out, with the frames for which the schedule has the
  // model: a mode does not go on to grow or fade.
  double time() const;
  bool small() const { return schedule_.at_once(); }

 private:
  // A group of frames on its way into the Gram matrix.
  struct Group {
    SnapshotRange span;
    int frames, slices, done = 0;
    bool solve;
    int build_slices;
    int64_t first_frame;  // of the span, counted from restart()
  };
  // Pictures of modes in the making.
  struct Build {
    int slices, done = 0;
    int64_t first_frame;
  };

  bool start_piece(const LiveSchedule::Step& step, const SnapshotRange& span, bool at_once);
  void work();
  bool publish();

  LiveSchedule schedule_;
  WindowSolver* solver_ = nullptr;
  SideThread* side_ = nullptr;
  int64_t model_start_ = 0;  // the frame at time 0 of the published model, counted from restart()
  // The side thread's between start() and settle().
  std::optional<Group> group_;
  std::optional<Build> build_;
  std::optional<int64_t> piece_due_;  // the frame before which a solve in one piece must end
  std::optional<int64_t> finished_;   // first frame of a solve that waits to be published
  double fixed_threshold_ = 0;
  double gram_seconds_ = 0, solve_seconds_ = 0, wait_seconds_ = 0;
};

}  // namespace qdmd
