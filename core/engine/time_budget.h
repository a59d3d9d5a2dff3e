// SPDX-License-Identifier: LGPL-2.1-or-later
// How much work a background gets, so that a frame takes no longer than the user allows.
#pragma once

#include <cstddef>
#include <vector>

namespace qdmd {

// How much work a background gets.
struct Effort {
  int period = 1;       // of so many windows (live: hops) one is solved
  int sample_step = 1;  // the decomposition sees every k-th pixel in x and y

  bool operator==(const Effort&) const = default;
};

// Seconds of one solve.
struct SolveCost {
  double once = 0;     // whatever the sample step
  double samples = 0;  // for each sampled pixel

  double sum() const { return once + samples; }
};

// The efforts that are worth their time (docs/accuracy-vs-time.md), the best first: each takes less
// time than the one before it. Samples become fewer first. Solves become fewer only then, because
// the background gets old between them. sample_steps: the steps to choose from, the finest first.
std::vector<Effort> front_of_efforts(const std::vector<int>& sample_steps);

// What a frame takes with an effort, learnt from stretches of frames.
class CostModel {
 public:
  explicit CostModel(int stretch_frames = 1) : stretch_frames_(stretch_frames) {}

  // A stretch of `frames` with a solve of that effort, in which a frame took `frame` beside it.
  void learn_solve(int frames, double frame, const Effort& effort, const SolveCost& solve);
  // One without.
  void learn_frame(double frame);
  // True once there was a stretch with a solve.
  bool known() const { return solves_seen_ > 0; }
  // Seconds for each frame; 0 as long as nothing was learnt.
  double predicted(const Effort& effort) const;

 private:
  void follow_speed(double expected, double seen);

  int stretch_frames_;
  // In seconds: a frame of a stretch without a solve, one of a stretch with it (in live mode they
  // share the processor), and of a solve what it takes once, and for the samples if it saw all
  // pixels.
  double frame_ = 0, frame_beside_ = 0, once_ = 0, pixels_ = 0;
  int solves_seen_ = 0, frames_seen_ = 0;  // stretches with a solve and without, the first few
};

// Frames come in stretches: windows in batch mode, hops in live mode. A stretch is solved, or keeps
// the background that there is. The time of both is measured, and the cost model learns from it
// which is the best effort that fits. If a stretch took too long, the next solve waits until that
// time is saved again.
class TimeBudget {
 public:
  // More seldom than once in so many stretches makes hardly anything cheaper.
  static constexpr int kMostPeriod = 16;

  // Starts afresh. front: not empty, the best first. frames: of a stretch.
  void begin(std::vector<Effort> front, int frames);
  // Seconds that a frame may take; 0: no limit, each stretch has the best effort. Measured costs
  // and time that is owed are kept.
  void set(double seconds_per_frame);
  bool limited() const { return budget_ > 0; }

  // Called once before each stretch: is it solved? enough: one of so many stretches has to be.
  bool next(int enough = 1);
  // The next stretch is solved, whatever is owed: it begins a new scene, or nobody knows it.
  void solve_next() { since_solve_ = 0; }
  // The seconds that this stretch took in all, and the part of its solve, if it was solved. A
  // stretch that ended early says little about others: its time counts, but no cost is learnt.
  void add(int frames, double seconds, const SolveCost& solve);

  // What the stretches from now on get.
  Effort effort() const { return front_.empty() ? Effort() : front_[chosen_]; }
  // What was learnt of the seconds that frames take.
  const CostModel& costs() const { return model_; }
  double predicted(const Effort& effort) const { return model_.predicted(effort); }

 private:
  void choose();

  std::vector<Effort> front_;
  size_t chosen_ = 0;
  double budget_ = 0;
  CostModel model_;
  int frames_ = 1;       // of a stretch
  Effort given_;         // to the newest one
  int since_solve_ = 0;  // stretches since the newest that was solved, that one included
  // The best effort that fitted with room to spare in each of the last comfortable_for_ stretches;
  // it is better than the chosen one.
  size_t comfortable_ = 0;
  int comfortable_for_ = 0;
  double debt_ = 0;  // seconds taken above the budget
};

}  // namespace qdmd
