// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/background.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/model/build_spread.h"
#include "core/passes/read_samples.h"

namespace qdmd {

namespace {

bool is_finite(const DmdSummary& summary) {
  return std::isfinite(std::abs(summary.lambda)) && !std::isnan(summary.omega) &&
         std::isfinite(summary.residual) && std::isfinite(summary.condition);
}

}  // namespace

Background::Background(std::unique_ptr<Learner> learner, const LearnerRoom& room, Colours colours,
                       const DecisionSteps& steps, const Levels& levels)
    : room_(room),
      colours_(colours),
      learner_(std::move(learner)),
      decision_(room.frames->width(), room.frames->height(), colours, steps, levels) {
  for (BackgroundModel& model : models_) {
    model.set_depth(room_.frames->depth());
    const RgbColours rgb(colours, levels);
    model.set_samples(rgb, rgb.range(levels));
  }
  learner_->begin(room_);
}

void Background::forget() {
  learner_->forget();
  decision_.forget();
  known_ = scene_begins_ = false;
  state_ = State::learnt;
}

void Background::begin_scene(bool returns, bool in_other_colours) {
  learner_->begin_scene(returns);
  scene_begins_ = !in_other_colours;
  scene_returns_ = returns;
}

void Background::begin_scene_at_once() {
  begin_scene(false);
  known_ = false;
  state_ = State::learnt;
}

void Background::return_to(const Learnt& learnt, bool in_other_colours) {
  begin_scene(true);
  make_room();
  recall(learnt);
  show(learnt, State::held_in_light);
  if (!in_other_colours) decision_.change_scene(true);
  scene_begins_ = false;
}

void Background::remember(Learnt* learnt) const {
  const BackgroundModel& model = models_[newest_];
  const size_t count = pixels();
  OwnedPicture& picture = learnt->picture;
  picture.resize(count, model.depth());
  for (size_t first = 0; first < count; first += kMaxRun) {
    const MutableSamples out[3] = {picture.samples(0) + first, picture.samples(1) + first,
                                   picture.samples(2) + first};
    model.evaluate(first, std::min(kMaxRun, count - first), out);
  }
  if (model.limits()) learnt->limits.assign(model.limits(), model.limits() + count);
  learnt->noise = report_.foreground.noise;
  learner_->remember(learnt);
}

void Background::show(const Learnt& learnt, State state) {
  const bool limits = learner_->makes_limits() && !learnt.limits.empty();
  model().freeze_as(learnt.picture, limits ? &learnt.limits : nullptr, pixels());
  learner_->follow(learnt.picture.level);
  report_ = {};
  report_.foreground.noise = learnt.noise;
  set_wishes(wishes_);
  known_ = true;
  state_ = state;
}

void Background::begin(const SnapshotRange& snapshots) {
  learner_->decompose(snapshots);
  snapshots_ = snapshots;
}

void Background::build(Slice slice) { learner_->build(slice, &models_[next()]); }

void Background::finish(const Wishes& wishes) {
  const Clock::Span span(*room_.clock, Clock::pictures);
  static_cast<SolveFacts&>(next_report_) = learner_->facts();
  if (!models_[next()].is_finite() || !is_finite(next_report_.dmd)) replace_next();
  next_report_.foreground =
      foreground_statistics(*snapshots_, models_[next()], wishes.foreground_threshold, *room_.pool,
                            wishes.ignored, room_.frames->width(), colours_);
  // Nobody decides before there is a first model.
  if (wishes.masks_expected && room_.models != Models::two_of_live && !known_ &&
      decision_.new_born())
    rehearse(wishes);
}

// Whatever a learner did: no model with a number that is not one is ever in use.
void Background::replace_next() {
  BackgroundModel& model = models_[next()];
  const TemporalModel mean = mean_of_frames(snapshots_->size());
  if (snapshots_->shape().is_shared()) {
    model.begin_from(snapshots_->size(), pixels(), mean);
    build_spread(*snapshots_, 0, pixels(), room_.pool, &model);
  } else {
    model.begin(*snapshots_, mean, true);
    model.build_slice(0, pixels());
  }
  next_report_.replaced = true;
  next_report_.dmd = {};
  next_report_.dmd.rank = next_report_.dmd.background_modes = 1;
  next_report_.dmd.lambda = 1;
  next_report_.dmd.converged = false;
}

// What moves is known before the first frame of a stream is decided.
void Background::rehearse(const Wishes& wishes) {
  constexpr int kEvery = 4;
  const bool fixed = wishes.foreground_threshold > 0;
  BackgroundModel& model = models_[next()];
  const ForegroundStatistics& foreground = next_report_.foreground;
  std::vector<uint8_t> room(room_for_planes(snapshots_->shape(), snapshots_->depth()));
  for (int t = 0; t < snapshots_->size(); t += kEvery) {
    model.set_time(t);
    snapshots_->will_need(t);
    snapshots_->will_need(t + kEvery);
    const PlaneRows x(snapshots_->picture(t), room.data());
    decide({{},
            &model,
            foreground.threshold,
            fixed ? nullptr : model.limits(),
            fixed,
            &wishes.ignored,
            wishes.shadows},
           x, room_.pool);
  }
}

void Background::decide(const PlaneRows& x, Pool* pool) {
  const bool fixed = wishes_.foreground_threshold > 0;
  decide({{},
          &model(),
          report_.foreground.threshold,
          fixed ? nullptr : model().limits(),
          fixed,
          &wishes_.ignored,
          wishes_.shadows},
         x, pool);
}

void Background::decide(Comparison frame, const PlaneRows& x, Pool* pool) {
  for (int c = 0; c < kChannels; ++c) frame.x[c] = x.samples(c);
  frame.rows = &x;
  decision_.decide(frame, pool);
}

void Background::publish() {
  newest_ = next();
  learner_->publish();
  if (std::exchange(scene_begins_, false)) decision_.change_scene(scene_returns_);
  report_ = next_report_;
  known_ = true;
  state_ = State::learnt;
  ++solves_;
  // Another may have been asked for since finish().
  set_wishes(wishes_);
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

void Background::set_wishes(const Wishes& wishes) {
  wishes_ = wishes;
  learner_->set_absorb_frames(wishes.absorb_frames);
  ForegroundStatistics& foreground = report_.foreground;
  const double threshold = wishes.foreground_threshold;
  foreground.threshold =
      threshold > 0 ? threshold : automatic_threshold(foreground.noise, colours_);
}

}  // namespace qdmd
