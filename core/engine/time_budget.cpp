// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/time_budget.h"

#include <algorithm>
#include <utility>

namespace qdmd {
namespace {

// What the newest stretch counts against all before: for the speed of the machine, so that a load
// that stays is known after two, and for what the parts take of it, which changes slowly.
constexpr double kNewest = 0.5, kNewestPart = 0.25;
// A better effort is taken only where it would have fitted into this share of the budget for so
// many stretches: an estimate that wavers must not change the choice each time.
constexpr double kMargin = 0.85;
constexpr int kPatience = 3;
// The first stretches of a kind, whose memory is touched for the first time, count for nothing once
// there is a newer one.
constexpr int kFirst = 2;
// One stretch says that the machine became slower or faster by this factor at most.
constexpr double kMostChange = 3;
// Solves wait while more is owed than this share of a stretch's budget. More than kMostDebt
// stretches are never owed: what a busy machine took for minutes is not paid back.
constexpr double kLoan = 0.5, kMostDebt = 4;

}  // namespace

std::vector<Effort> front_of_efforts(const std::vector<int>& sample_steps) {
  std::vector<Effort> front;
  for (int step : sample_steps) front.push_back({1, step});
  // More of them would cost about the same, and the choice would waver.
  for (int period : {2, 3, 4, 6, 8, 12, TimeBudget::kMostPeriod}) {
    front.push_back(front.back());
    front.back().period = period;
  }
  return front;
}

double CostModel::predicted(const Effort& effort) const {
  const double samples = pixels_ / (static_cast<double>(effort.sample_step) * effort.sample_step);
  return frame_ + (frame_beside_ - frame_ + (once_ + samples) / stretch_frames_) / effort.period;
}

// What slows one thing down slows everything.
void CostModel::follow_speed(double expected, double seen) {
  if (expected <= 0) return;
  const double change = std::clamp(seen / expected, 1 / kMostChange, kMostChange);
  for (double* part : {&frame_, &frame_beside_, &once_, &pixels_})
    *part *= 1 + kNewest * (change - 1);
}

void CostModel::learn_solve(int frames, double frame, const Effort& effort,
                            const SolveCost& solve) {
  const double area = static_cast<double>(effort.sample_step) * effort.sample_step;
  const bool known = solves_seen_ >= kFirst;
  if (known)
    follow_speed(frame_beside_ * frames + once_ + pixels_ / area, frame * frames + solve.sum());
  const auto learn = [known](double* part, double seen) {
    *part += (known ? kNewestPart : 1) * (seen - *part);
  };
  learn(&frame_beside_, frame);
  learn(&once_, solve.once);
  learn(&pixels_, solve.samples * area);
  if (frames_seen_ == 0) frame_ = frame_beside_;
  solves_seen_ = std::min(solves_seen_ + 1, kFirst);
}

void CostModel::learn_frame(double frame) {
  const bool known = frames_seen_ >= kFirst;
  if (known) follow_speed(frame_, frame);
  frame_ += (known ? kNewestPart : 1) * (frame - frame_);
  frames_seen_ = std::min(frames_seen_ + 1, kFirst);
}

void TimeBudget::begin(std::vector<Effort> front, int frames) {
  const double budget = budget_;
  *this = TimeBudget();
  front_ = std::move(front);
  model_ = CostModel(frames);
  frames_ = frames;
  budget_ = budget;
}

void TimeBudget::set(double seconds_per_frame) {
  // No number: no limit.
  const double budget = seconds_per_frame > 0 ? seconds_per_frame : 0;
  if (budget == budget_) return;
  budget_ = budget;
  chosen_ = 0;
  comfortable_for_ = 0;
  choose();
}

bool TimeBudget::next(int enough) {
  const bool due = since_solve_ == 0 || since_solve_ >= kMostPeriod ||
                   (since_solve_ >= std::max(enough, effort().period) &&
                    (!limited() || debt_ <= kLoan * budget_ * frames_));
  if (due) since_solve_ = 0;
  ++since_solve_;
  given_ = effort();
  return due;
}

void TimeBudget::add(int frames, double seconds, const SolveCost& solve) {
  if (frames <= 0) return;
  if (2 * frames > frames_) {
    const double frame = std::max(0.0, seconds - solve.sum()) / frames;
    if (solve.sum() > 0)
      model_.learn_solve(frames, frame, given_, solve);
    else
      model_.learn_frame(frame);
  }
  debt_ = std::clamp(debt_ + seconds - budget_ * frames, 0.0, kMostDebt * budget_ * frames_);
  choose();
}

void TimeBudget::choose() {
  if (!limited() || !model_.known()) return;
  const auto best_within = [this](double allowed) {
    size_t i = 0;
    while (i + 1 < front_.size() && predicted(front_[i]) > allowed) ++i;
    return i;
  };
  chosen_ = std::max(chosen_, best_within(budget_));
  const size_t comfortable = best_within(kMargin * budget_);
  if (comfortable >= chosen_) {
    comfortable_for_ = 0;
    return;
  }
  comfortable_ = comfortable_for_ > 0 ? std::max(comfortable_, comfortable) : comfortable;
  if (++comfortable_for_ < kPatience) return;
  chosen_ = comfortable_;
  comfortable_for_ = 0;
}

}  // namespace qdmd
