#include "core/engine/background.h"

#include <algorithm>
#include <utility>

namespace qdmd {

Background::Background(std::unique_ptr<Learner> learner, const LearnerRoom& room)
    : room_(room), learner_(std::move(learner)) {
  learner_->begin(room_);
}

void Background::forget() {
  learner_->forget();
  known_ = false;
  state_ = State::learnt;
}

void Background::remember(Learnt* learnt) const {
  const BackgroundModel& model = models_[newest_];
  const size_t count = pixels();
  for (auto& level : learnt->level) level.resize(count);
  for (size_t first = 0; first < count; first += kMaxRun) {
    uint8_t* const out[3] = {learnt->level[0].data() + first, learnt->level[1].data() + first,
                             learnt->level[2].data() + first};
    model.evaluate(first, std::min(kMaxRun, count - first), out);
  }
  if (model.limits()) learnt->limits.assign(model.limits(), model.limits() + count);
  learnt->noise = report_.foreground.noise;
  learner_->remember(learnt);
}

void Background::show(const Learnt& learnt, State state) {
  const bool limits = learner_->makes_limits() && !learnt.limits.empty();
  model().freeze_as(learnt.level, limits ? &learnt.limits : nullptr, pixels());
  learner_->follow(learnt.level);
  report_ = {};
  report_.foreground.noise = learnt.noise;
  set_threshold(fixed_threshold_);
  known_ = true;
  state_ = state;
}

void Background::begin(const SnapshotRange& snapshots) {
  learner_->decompose(snapshots);
  snapshots_ = snapshots;
}

void Background::build(Slice slice) { learner_->build(slice, &models_[next()]); }

void Background::finish(double fixed_threshold) {
  const Clock::Span span(*room_.clock, Clock::pictures);
  static_cast<SolveFacts&>(next_report_) = learner_->facts();
  next_report_.foreground = foreground_statistics(*snapshots_, models_[next()], fixed_threshold);
}

void Background::publish() {
  newest_ = next();
  learner_->publish();
  report_ = next_report_;
  known_ = true;
  state_ = State::learnt;
  ++solves_;
  // Another may have been asked for since finish().
  set_threshold(fixed_threshold_);
}

void Background::hold(double t, State state) {
  if (state_ == State::learnt) {
    if (state == State::held_in_light) model().set_light(kSameLight);
    model().freeze_at(t);
  }
  state_ = state;
}

void Background::follow_light(int slot) {
  if (learner_->follows_light()) model().set_light(learner_->light(slot));
}

void Background::set_threshold(double fixed) {
  fixed_threshold_ = fixed;
  ForegroundStatistics& foreground = report_.foreground;
  foreground.threshold = fixed > 0 ? fixed : automatic_threshold(foreground.noise);
}

}  // namespace qdmd
