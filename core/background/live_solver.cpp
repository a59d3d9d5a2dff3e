#include "core/background/live_solver.h"

#include <algorithm>

#include "core/background/stopwatch.h"

namespace qdmd {

void LiveSolver::restart(bool has_model) {
  schedule_.restart(has_model ? schedule_.hop_size() : 1);
}

void LiveSolver::stop() {
  try {
    side_->finish();
  } catch (...) {
    // Nobody waits for the result.
  }
  group_.reset();
  build_.reset();
  piece_due_.reset();
  finished_.reset();
}

bool LiveSolver::publish() {
  if (!finished_) return false;
  model_start_ = *finished_;
  finished_.reset();
  solver_->publish();
  return true;
}

bool LiveSolver::settle() {
  if (piece_due_ && schedule_.frames() + 1 < *piece_due_) return false;
  piece_due_.reset();
  {
    const Stopwatch watch(&wait_seconds_);
    side_->finish();
  }
  return publish();
}

bool LiveSolver::start(const Window& window, double fixed_threshold, bool at_once,
                       const std::function<bool()>& solve_now) {
  LiveSchedule::Step step = schedule_.next();
  if (step.solve) step.solve = solve_now();
  // Frames that are kept for a solve in progress are no part of the window.
  const int size = static_cast<int>(
      std::min<int64_t>({schedule_.frames(), schedule_.window_size(), window.size()}));
  if (schedule_.in_one_piece()) {
    if (!step.solve) return false;
    fixed_threshold_ = fixed_threshold;
    return start_piece(step, SnapshotRange(window).newest(size), at_once);
  }
  if (step.group > 0) {
    group_ = Group{SnapshotRange(window).newest(size),
                   step.group,
                   step.gram_slices,
                   0,
                   step.solve,
                   step.build_slices,
                   schedule_.frames() - size};
  }
  if (!group_ && !build_) return false;
  fixed_threshold_ = fixed_threshold;
  {
    const Stopwatch watch(&wait_seconds_);
    if (!at_once)
      side_->start([this] { work(); });
    else
      while (group_ || build_) work();
  }
  return at_once && publish();
}

bool LiveSolver::start_piece(const LiveSchedule::Step& step, const SnapshotRange& span,
                             bool at_once) {
  solver_->decompose(span);
  build_ = Build{1, 0, schedule_.frames() - span.size()};
  const Stopwatch watch(&wait_seconds_);
  if (at_once) {
    work();
    return publish();
  }
  piece_due_ = schedule_.frames() + step.build_slices;
  side_->start([this] { work(); });
  return false;
}

double LiveSolver::time() const {
  int last = solver_->report().window_frames - 1;
  if (!solver_->follows_light()) last += schedule_.hop_size() + schedule_.most_late_frames();
  return static_cast<double>(std::min<int64_t>(schedule_.frames() - 1 - model_start_, last));
}

// One frame's share. Pictures come first: the solve after them needs their place.
void LiveSolver::work() {
  if (build_) {
    const Stopwatch watch(&solve_seconds_);
    solver_->build(build_->done, build_->slices);
    if (++build_->done == build_->slices) {
      solver_->finish(fixed_threshold_);
      finished_ = build_->first_frame;
      build_.reset();
    }
  }
  if (group_) {
    {
      const Stopwatch watch(&gram_seconds_);
      solver_->add_to_gram(group_->span, group_->frames, group_->done, group_->slices);
    }
    if (++group_->done < group_->slices) return;
    if (group_->solve) {
      const Stopwatch watch(&solve_seconds_);
      solver_->decompose(group_->span);
      build_ = Build{group_->build_slices, 0, group_->first_frame};
    }
    group_.reset();
  }
}

}  // namespace qdmd
