// SPDX-License-Identifier: LGPL-2.1-or-later
// From frames to a model of their background.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/channels.h"
#include "core/base/clock.h"
#include "core/dmd/options.h"
#include "core/frames/frame_store.h"
#include "core/learn/method.h"
#include "core/learn/robust/learning_steps.h"
#include "core/learn/uncovered.h"
#include "core/model/background_model.h"
#include "core/model/learnt.h"
#include "core/parallel/pool.h"
#include "core/passes/bands.h"

namespace qdmd {

// About one solve.
struct SolveFacts {
  DmdSummary dmd;
  int window_frames = 0;
  int sample_step = 1;  // the decomposition saw every k-th pixel in x and y
  int iterations = 1;
  // The model was not finite: the mean of the window's frames is in its place.
  bool replaced = false;
  // A camera that starts has found its exposure, as far as the learner looks at that.
  bool settled = true;
  // Seconds in the Gram matrix since the solve before, and in the solve.
  double gram_time = 0, solve_time = 0;
};

// What models a learner makes.
enum class Models {
  one,         // the next in place of the one in use
  two,         // the next beside the one in use
  two_of_live  // and the one in use outlives its window's frames: all its modes are pictures
};

// What a camera shows: the scene of the background, another one, or the one that it showed before
// that; the same scene in other colours, or in those that it had before.
enum class SceneSeen { same, another, the_one_before, other_colours, earlier_colours };

// Where a learner works.
struct LearnerRoom {
  const FrameStore* frames;  // made for the learner's contents()
  int window_size;           // snapshots of a solve, at most
  Models models;
  Pool* pool;
  Clock* clock;
};

// One method. A solve is add() for groups of frames as they come, each in slices of pixels;
// decompose(); build() in slices. One step at a time, from any thread; the pool's threads help.
// May throw std::bad_alloc; what was under way is lost then.
class Learner {
 public:
  // That of options.method, for frames of that size. Takes no memory for them yet.
  static std::unique_ptr<Learner> make(const LearnOptions& options, int width, int height);
  virtual ~Learner() = default;

  // ---- What it needs ----

  // What is kept of each frame, beside its planes.
  virtual FrameContents contents() const = 0;
  // The steps that it can sample pixels with, the finest first: it begins with that.
  virtual std::vector<int> sample_steps() const = 0;
  // True: a solve is one piece of work, add() does nothing and build() has one slice.
  virtual bool in_one_piece() const = 0;
  // Bytes beside the frames, for as many as a FrameStore of `capacity` has, with its models: the
  // most that are taken at once.
  virtual uint64_t bytes(int window_size, int capacity, Models models, int threads) const = 0;
  // True where a model may read its window's frames as long as it is in use, Models::two_of_live
  // aside.
  virtual bool may_read_frames(int window_size) const = 0;
  // Bytes more where the store's frames come to share no samples (FrameStore::steady()).
  virtual uint64_t bytes_to_unshare() const { return 0; }
  // Estimate of the seconds of a solve of so many frames, with two threads of a machine of 2024.
  virtual double solve_seconds(int frames, Models models) const = 0;
  // Estimate of the bytes of a solver that works on pixels; 0: it works on the Gram matrix.
  virtual uint64_t solver_bytes(int window_size) const = 0;

  // ---- Solves ----

  // Before all others. Takes memory.
  virtual void begin(const LearnerRoom& room) = 0;
  // Forgets what earlier windows showed of the background.
  virtual void forget() {}
  // Adds to `learnt` what solves to come are told of the background, and takes that from there
  // (what does not suit it, it leaves: nothing is known then). Not while a solve runs.
  virtual void remember(Learnt* /*learnt*/) const {}
  // Where it throws, all is as it was.
  virtual void recall(const Learnt& /*learnt*/) {}
  // True where models have limits.
  virtual bool makes_limits() const { return false; }
  // Sets the step of the solves to come: one of sample_steps(). Not while one runs.
  virtual void set_sample_step(int) {}

  // The inner products of the newest `frames` snapshots of `span` with all of it. Slices of a group
  // come in order.
  virtual void add(const SnapshotRange& span, int frames, Slice slice) = 0;
  // Once all snapshots were added. They stay as they are until build() is done and, unless pictures
  // are kept, until the next solve.
  virtual void decompose(const SnapshotRange& snapshots) = 0;
  // Makes `model` the snapshots' background; slices come in order.
  virtual void build(Slice slice, BackgroundModel* model) = 0;
  // What is known of the newest model that was built whole.
  virtual SolveFacts facts() const = 0;
  // What follows the frames as they come may leave out solves: one of so many hops is enough, as
  // the newest solves found hardly anything new. Not while one runs.
  virtual int enough() const { return 1; }
  // That model is now the one in use.
  virtual void publish() {}

  // ---- What was uncovered, and what stays ----

  // Once for each frame, before it is compared with the background in use, `model`. Where frames
  // show that something has left that the model took for background (live), or that something which
  // came stood still for the time to absorb, the model has what they show from now on.
  static constexpr int kMendingFrames = steps::mending::kFrames;
  struct Compared {
    SnapshotRange around;  // the frame, and others that come next to it, kMendingFrames at most
    int at = 0;            // which of them it is
    int64_t number = 0;    // of that frame, counted like FrameStore::frames_taken()
    double t = 0;          // the frame's time in the model
    bool live = false;
    bool mends = true;  // look_ahead(): the model is in use, and may be mended
  };
  virtual void mend(const Compared& /*frame*/, BackgroundModel* /*model*/) {}
  // With each frame that comes, in order, where frames wait to be compared (batch). Where it and
  // those before it show what is behind the background in use, `model` (null: there is none),
  // frames that are compared from now on find that, if it may be mended. t: the time of the one
  // that is compared next.
  virtual void look_ahead(const Compared& /*frame*/, BackgroundModel* /*model*/) {}
  // Where the frames that were looked at show that something has left. Null: the method does not
  // know.
  virtual UncoveredPlaces* uncovered() { return nullptr; }
  // Takes effect with the next frame. 0: never.
  virtual void set_absorb_frames(int64_t) {}

  // ---- Another scene ----

  // What the newest kSceneFrames show, which came after one another, the last in `slot`: the scene
  // of the background in use, or another one. What is not the same is said once, until there is a
  // background of that scene.
  virtual SceneSeen scene_of(int /*slot*/) { return SceneSeen::same; }
  static constexpr int kSceneFrames = steps::scene::kFrames;
  // Solves to come know nothing of what was before; the background in use stays. Not while one
  // runs.
  // returns: it is the scene that was left last, and what was known of it is known again.
  virtual void begin_scene(bool /*returns*/) {}
  // Where scene_of() said that the scene has other colours: gives `learnt` these. False, and
  // changes nothing, where nobody knows them.
  virtual bool recolour(Learnt* /*learnt*/) const { return false; }

  // ---- Light ----

  // True where the background in use is to have the light() of each frame.
  virtual bool follows_light() const { return false; }
  // The background in use is this picture now, which no window made. Not while a solve runs.
  virtual void follow(const std::vector<uint8_t> /*level*/[kChannels]) {}
  // The light of the frame in `slot`, over the background in use.
  virtual Gain light(int /*slot*/) { return kSameLight; }
};

}  // namespace qdmd
