// How seldom a background is solved, so that a frame takes no longer than somebody asked for.
#pragma once

namespace qdmd {

// Frames come in stretches: windows in batch mode, hops in live mode. A stretch is solved, or keeps
// the background that there is. What both take is measured; of every period() stretches one is
// solved, as often as the budget allows. Frames, pixels and iterations stay as they are: a
// background of the window before differs little where fewer of them would differ in each frame.
class TimeBudget {
 public:
  // More seldom than once in so many stretches makes hardly anything cheaper.
  static constexpr int kMostPeriod = 16;

  // Seconds that a frame may take; 0: every stretch is solved. Estimates are kept.
  void set(double seconds_per_frame);
  bool limited() const { return budget_ > 0; }

  // Called once before each stretch: is it solved?
  bool next();
  // What the stretch took in all, and what of it a solve did (0: it was not solved).
  void add(int frames, double seconds, double solve_seconds);

  int period() const { return period_; }
  // The cost model: seconds for each frame where one of `period` stretches is solved; 0 as long as
  // nothing was measured.
  double predicted(int period) const;
  double predicted() const { return predicted(period_); }

 private:
  void choose();

  double budget_ = 0;
  double with_solve_ = 0, without_ = 0;  // seconds for each frame of such stretches
  int period_ = 1;
  int until_solve_ = 0;  // stretches before the next that is solved
};

}  // namespace qdmd
