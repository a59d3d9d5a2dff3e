// SPDX-License-Identifier: LGPL-2.1-or-later
// Which stretches of frames are solved, so that frames keep to the time that they may take.
#pragma once

#include "core/base/clock.h"
#include "core/engine/time_budget.h"

namespace qdmd {

class Background;

// Frames come in stretches: windows in batch mode, hops in live mode. Reads from the clock what
// each took, and asks the budget about the next.
class Pace {
 public:
  explicit Pace(const Clock* clock) : clock_(clock) {}

  // Starts afresh. front: the efforts to choose from. frames: of a stretch.
  void begin(std::vector<Effort> front, int frames);
  // The frames before are gone: nobody knows what they took.
  void restart();
  // Seconds that a frame may take on average; 0: no limit.
  void set_budget(double seconds_per_frame) { budget_.set(seconds_per_frame); }
  const TimeBudget& budget() const { return budget_; }

  void count_frame() { ++frames_; }
  // The stretch before is over. True: the next one is solved; `background` was told how.
  // enough: one of so many stretches has to be solved.
  bool next_stretch(Background* background, int enough = 1);
  // The next stretch is solved, whatever is owed: it begins a new scene, or nobody knows it.
  void solve_next() { budget_.solve_next(); }

 private:
  const Clock* clock_;
  TimeBudget budget_;
  // When the stretch that runs began, its frames so far, and whether it is solved.
  Clock::Spent start_;
  int frames_ = 0;
  bool solves_ = true;
};

}  // namespace qdmd
