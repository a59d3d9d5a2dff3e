// SPDX-License-Identifier: LGPL-2.1-or-later
// The background that frames are compared with, and the one in the making.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/engine/wishes.h"
#include "core/foreground/decision.h"
#include "core/foreground/foreground.h"
#include "core/learn/learner.h"

namespace qdmd {

// About the newest solve.
struct SolveReport : SolveFacts {
  ForegroundStatistics foreground;
};

// Owns a learner and its models. begin(), build() and finish() make the next model, from any
// thread, one at a time; publish() then puts it in use. All other calls are about the model in use.
class Background {
 public:
  // Learnt anew with each solve; or held as it was; or held, but for the light of each frame.
  enum class State { learnt, held, held_in_light };

  Background(std::unique_ptr<Learner> learner, const LearnerRoom& room,
             Colours colours = Colours::rgb, const DecisionSteps& steps = {},
             const Levels& levels = {});

  Learner& learner() { return *learner_; }
  // Forgets the model and what earlier windows showed.
  void forget();
  // Learner::begin_scene(); masks do so with the next publish(). in_other_colours: the camera shows
  // the same places, and masks go on with what they know of them.
  void begin_scene(bool returns, bool in_other_colours = false);
  // As begin_scene() of a scene that nobody knows, and there is no background until that publish().
  void begin_scene_at_once();
  // The camera shows the scene of `learnt` again, or this one in the colours of `learnt`: its
  // background is in use, in the light of each frame. If it throws, nothing is known.
  void return_to(const Learnt& learnt, bool in_other_colours);

  // Writes all that is known into `learnt`, with L at the time and light that the model is set to.
  void remember(Learnt* learnt) const;
  // The next solves take it for the background of the window before them. Call neither this nor
  // show() while a solve runs. If it throws, nothing has changed.
  void recall(const Learnt& learnt) { learner_->recall(learnt); }
  // Puts its picture in use, and holds it until publish(). Throws only if make_room() was not
  // called before; if make_room() throws, nothing has changed.
  void show(const Learnt& learnt, State state);
  void make_room() { model().make_room(pixels(), learner_->makes_limits()); }

  // ---- The next ----

  // Learner::decompose(). What is finished and not yet published stays.
  void begin(const SnapshotRange& snapshots);
  // Learner::build().
  void build(Slice slice);
  // After the last slice. wishes: as they were when the work began.
  void finish(const Wishes& wishes);
  // Learnt again.
  void publish();

  // ---- The one in use ----

  // True once there is one.
  bool known() const { return known_; }
  BackgroundModel& model() { return models_[newest_]; }
  const SolveReport& report() const { return report_; }
  // Published since this was made.
  uint64_t solves() const { return solves_; }
  State state() const { return state_; }

  // Holds L(t) at this time t, or goes on holding L in another state. The snapshots are no longer
  // needed then.
  void hold(double t, State state);
  // Learner::mend(), of the L in use.
  void mend(const Learner::Compared& frame) { learner_->mend(frame, &model()); }
  // Learner::look_ahead(), of the L in use. used: frames wait whose background it is.
  void look_ahead(const Learner::Compared& frame, bool used) {
    Learner::Compared compared = frame;
    compared.mends = used && state_ == State::learnt;
    learner_->look_ahead(compared, known_ ? &model() : nullptr);
  }
  // Sets L to the light of the frame in `slot`, where the method has one.
  void follow_light(int slot);

  // Decides the pixels of a frame, whose planes are x, against L; frames come in order. Makes all
  // of their rows.
  void decide(const PlaneRows& x, Pool* pool);
  // What it decided last.
  Decision& decision() { return decision_; }
  const Decision& decision() const { return decision_; }

  // They hold from now on, for masks and for what is learnt.
  void set_wishes(const Wishes& wishes);
  const Wishes& wishes() const { return wishes_; }

 private:
  void replace_next();
  void rehearse(const Wishes& wishes);
  void decide(Comparison frame, const PlaneRows& x, Pool* pool);
  size_t pixels() const { return room_.frames->window().pixels(); }
  int next() const { return room_.models == Models::one ? newest_ : 1 - newest_; }

  LearnerRoom room_;
  Colours colours_;
  std::unique_ptr<Learner> learner_;
  Decision decision_;
  // If there are two, one is in use while the next is built.
  BackgroundModel models_[2];
  int newest_ = 0;
  std::optional<SnapshotRange> snapshots_;  // of the next
  SolveReport report_, next_report_;
  State state_ = State::learnt;
  bool known_ = false, scene_begins_ = false, scene_returns_ = false;
  uint64_t solves_ = 0;
  Wishes wishes_;
};

}  // namespace qdmd
