// SPDX-License-Identifier: LGPL-2.1-or-later
// The background separator: frames in, pictures out. No GStreamer.
#pragma once

#include <cstdint>
#include <memory>

#include "core/engine/engine_plan.h"
#include "core/engine/leaving_frame.h"
#include "core/engine/schedule.h"
#include "core/engine/wishes.h"
#include "core/frames/frame_reducer.h"

namespace qdmd {

// How an engine stands.
struct EngineReport {
  SolveReport solve;    // about the newest solve
  uint64_t solves = 0;  // that came into use
  // Scenes that began while frames came: the camera was moved, covered, or switched to another
  // view. Learning then began anew. Method::robust only.
  uint64_t scenes = 0;
  uint64_t views = 0;   // how often the camera moved further than an eighth of the picture
  int delay = 0;        // frames that are pushed before a frame leaves: EngineLayout::delay
  int pending = 0;      // frames pushed and not left
  int frames_left = 0;  // so many of them leave with the background that `solve` is about
  // The newest push() took longer than one frame needs: it waited for a solve, or did work of a
  // solve itself, because no thread was free or because the solve was due.
  bool held_up = false;
  // max_memory has no room for a second copy of frames that are moved: they are taken as they come.
  bool no_room_for_motion = false;
  // Bytes that count against max_memory: those of EngineLayout, and those for alpha that varies and
  // for soft masks once there are any.
  uint64_t bytes = 0;
  Pose newest_pose;  // where the camera looked in the newest frame that was pushed
  Effort effort;     // that solves get to keep the time budget
  CostModel costs;   // what was learnt of the time that frames take
};

// Batch: push() collects window_size frames. The window is then solved, at once or beside the
// frames that follow. From then on one frame becomes ready with each push(), in order, `delay`
// frames after it came, against its own window's L(t). drain() makes all frames ready. If an
// unfinished window is left, it is solved on the last window_size frames seen (or on fewer, if the
// stream is shorter).
// Live: each push() makes its frame ready, against the newest model, extrapolated to the frame's
// time. A solve on the last window_size frames begins every hop_size frames, and earlier while the
// window fills up. Its work is spread over the frames that follow (LivePlan). drain() begins a new
// window and keeps the background as it is until there is a new model.
// Every frame pushed leaves exactly once, unless flush() drops it. Results do not depend on the
// number of threads or on time, unless there is a time budget. Not thread safe. Throws
// std::bad_alloc if memory runs out: frames that wait are then lost, as after flush(), and the
// engine goes on with the next frame. If configure() throws it, the engine is not configured.
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  // Starts afresh with frames of width x height pixels (EnginePlan). If it refuses, nothing has
  // changed.
  Status configure(const EngineOptions& options, int width, int height);
  bool configured() const { return schedule_ != nullptr; }
  // What it was configured with.
  const EnginePlan& plan() const { return plan_; }
  // Gives all memory and threads back; configure() comes next.
  void close();

  // Copies a frame in. wishes: what of them is taken with a frame holds from now on; null: no
  // others than before.
  Status push(const ImageView& frame, const Wishes* wishes = nullptr);
  // The frame that leaves next, or null while none is ready. It stays the next one until it is told
  // to leave. wishes: as in push(), of those that are taken when a frame leaves.
  LeavingFrame* next(const Wishes* wishes = nullptr);
  // Makes every waiting frame ready; windows may be solved as their frames leave. The next frame
  // that is pushed begins a new window.
  Status drain();
  // Drops all frames and forgets the window and the model.
  void flush();
  // No frame waits after drain(): the next frame comes after the one before it, after all. A window
  // that ends early has the frames before it. Batch only.
  void go_on();

  // Writes the newest background, in the frames' size. Batch: the background of the last frame of
  // the newest solved window. Live: of the frame with which the newest model came. While a
  // background is held: that one. False: there is none yet.
  bool write_background(const MutableImageView& out);
  // Gives all that was learnt about the background that write_background() writes, with its
  // picture; the caller sets its colours. False: nothing is learnt yet. Waits for a solve that is
  // under way. If it throws, no frame is lost.
  bool learnt(Learnt* learnt);
  // Goes on from what an earlier run learnt. This background is held until there is a model of this
  // run's frames, as after drain(), and method=robust takes it for the background of the window
  // before. Live: it is used at once, and the next frame begins a new window. Batch: windows that
  // end after this call learn from it. Its picture is used if there is no background yet or no
  // frame waits; else by the next window that begins, if that one is held. Not ok if the size is
  // another (EnginePlan::may_learn_from); nothing has changed then. Waits and throws like learnt().
  Status learn_from(const Learnt& learnt);

  EngineReport report() const;
  // Here the caller charges the time that a frame takes beside the calls to the engine, for
  // instance for a conversion. It counts in the time budget.
  Clock& clock() { return clock_; }

 private:
  Status check(const ImageView& frame) const;
  void follow_wishes();

  EnginePlan plan_;
  Wishes wishes_;  // of the frames
  Clock clock_;
  Pace pace_{&clock_};
  FrameStore frames_;
  // Where masks are found in a smaller picture.
  std::unique_ptr<FrameReducer> reducer_;
  std::unique_ptr<Enlarger> enlarger_;
  std::unique_ptr<Stabilizer> stabilizer_;
  std::unique_ptr<Restorer> restorer_;
  std::unique_ptr<Background> background_;
  std::unique_ptr<Schedule> schedule_;
  std::unique_ptr<LeavingFrame> leaving_;
  // The last member: its threads end before what they work on.
  std::unique_ptr<Workers> workers_;
};

}  // namespace qdmd
