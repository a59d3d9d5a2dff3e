// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/pace.h"

#include <utility>

#include "core/engine/background.h"

namespace qdmd {

void Pace::begin(std::vector<Effort> front, int frames) {
  budget_.begin(std::move(front), frames);
  restart();
}

void Pace::restart() {
  start_ = clock_->spent();
  frames_ = 0;
  solves_ = true;
  budget_.solve_next();
}

bool Pace::next_stretch(Background* background, int enough) {
  const Clock::Spent now = clock_->spent(), spent = now.since(start_);
  SolveCost cost;
  if (solves_)
    cost = {spent.of(Clock::solving) + spent.of(Clock::pictures), spent.of(Clock::samples)};
  budget_.add(frames_, spent.all(), cost);
  start_ = now;
  frames_ = 0;
  solves_ = budget_.next(enough);
  if (solves_) background->learner().set_sample_step(budget_.effort().sample_step);
  return solves_;
}

}  // namespace qdmd
