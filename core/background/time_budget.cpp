#include "core/background/time_budget.h"

#include <algorithm>

namespace qdmd {
namespace {

// What the newest stretch counts against all before: a load that stays is known after two.
constexpr double kNewest = 0.5;
// Solves become more frequent only where they then fit into this share of the budget: an estimate
// that wavers at its edge must not change the choice each time.
constexpr double kMargin = 0.85;
// One stretch says that the machine became slower or faster by this factor at most.
constexpr double kMostChange = 3;

}  // namespace

void TimeBudget::set(double seconds_per_frame) {
  if (seconds_per_frame == budget_) return;
  budget_ = seconds_per_frame;
  period_ = 1;
  until_solve_ = 0;
  choose();
}

double TimeBudget::predicted(int period) const {
  return without_ + (with_solve_ - without_) / period;
}

bool TimeBudget::next() {
  if (!limited()) return true;
  if (until_solve_ > 0) {
    --until_solve_;
    return false;
  }
  until_solve_ = period_ - 1;
  return true;
}

void TimeBudget::add(int frames, double seconds, double solve_seconds) {
  if (frames <= 0) return;
  const double newest = seconds / frames;
  if (with_solve_ == 0) {
    // The first one. A stretch that is not solved takes what is left.
    with_solve_ = newest;
    without_ = std::max(0.0, seconds - solve_seconds) / frames;
  } else {
    double& seen = solve_seconds > 0 ? with_solve_ : without_;
    double& other = solve_seconds > 0 ? without_ : with_solve_;
    const double before = seen;
    seen += kNewest * (newest - seen);
    // What slows the one down slows the other.
    if (before > 0) other *= std::clamp(seen / before, 1 / kMostChange, kMostChange);
    with_solve_ = std::max(with_solve_, without_);
  }
  choose();
}

void TimeBudget::choose() {
  if (!limited() || with_solve_ == 0) return;
  const auto least_period = [this](double allowed) {
    int period = 1;
    while (period < kMostPeriod && predicted(period) > allowed) ++period;
    return period;
  };
  const int needed = least_period(budget_);
  const int comfortable = least_period(kMargin * budget_);
  if (needed > period_) period_ = needed;
  if (comfortable < period_) period_ = comfortable;
  until_solve_ = std::min(until_solve_, period_ - 1);
}

}  // namespace qdmd
