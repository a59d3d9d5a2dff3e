// The background separator: frames in, pictures out. No GStreamer.
#pragma once

#include <memory>

#include "core/engine/engine_options.h"
#include "core/engine/schedule.h"
#include "core/foreground/soft_mask.h"

namespace qdmd {

// Batch: push() collects window_size frames, which are then solved, at once or beside the frames
// that follow; from then on a frame is ready with each that is pushed, in order, each against its
// own window's L(t), delay() frames later. drain() makes all ready; a remainder is solved on the
// last window_size frames seen (fewer where the stream is shorter). Live: each push() makes its
// frame ready, against the newest model, extrapolated to the frame's time. A solve on the last
// window_size frames begins every hop_size frames, earlier while the window fills up, and its work
// is spread over the frames that follow (LivePlan). drain() begins a new window and keeps the
// background as it is until there is a new model. Every frame pushed is popped exactly once, unless
// flush() drops it. Results do not depend on the number of threads or on time. Not thread safe.
// Throws std::bad_alloc where memory runs out. Frames that wait are lost then, as after flush(),
// and the engine goes on with the next frame; after configure() it is not configured.
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  // Starts afresh with frames of width x height pixels. Where it refuses, all is as it was.
  Status configure(const EngineOptions& options, int width, int height);
  bool configured() const { return schedule_ != nullptr; }
  // Gives all memory and threads back; configure() comes next.
  void close();

  // Copies a frame in.
  Status push(const ImageView& frame);
  // The newest push() took longer than a frame alone does: work of a solve was done in it, for want
  // of a thread or because it was due, or waited for.
  bool held_up() const { return schedule_ && schedule_->held_up(); }
  // True while pop() has a frame.
  bool ready() const { return queue_.ready > 0; }
  // Writes a picture of the next frame, which stays the next: any number of pictures share what is
  // computed of it. Call only while ready(); `out` has the configured size. Its black, white and
  // neutral chroma are `levels`: the configured ones, or, of a mask in another format, its own.
  // Samples have the configured depth, or 8 bits: the highest ones.
  void write(Output output, const Levels& levels, const MutableImageView& out);
  // The next frame has left. Call only while ready().
  void skip();
  // write() in the configured levels, and skip().
  void pop(Output output, const MutableImageView& out);
  // Of the frame that leaves next, width * height samples each: its mask, as Output::mask has
  // it, and the lengths of its residuals in levels, at most 255. Call only while ready().
  void foreground(uint8_t* mask, uint8_t* residual);
  // Writes the newest background: that of the last frame of a batch that was solved for, or of the
  // frame with which a live model came; or the one that is held. False: there is none yet.
  bool write_background(const MutableImageView& out);
  // What was learnt of the background that write_background() writes, with its picture; its colours
  // are the caller's. False: nothing yet. Waits for a solve that is under way. Where it throws, no
  // frame is lost.
  bool learnt(Learnt* learnt);
  // Goes on with what an earlier run learnt: the background is held until there is a model of this
  // one's frames, as after drain(), and method=robust is told of it as of a window before. Live: at
  // once, and the next frame begins a new window. Batch: windows that end from now on are told; the
  // picture is used where there is no background yet, or no frame waits, or by the next window that
  // begins, if it is held. Not ok where the size is another; all is then as it was. Waits, and
  // throws, as learnt() does.
  Status learn_from(const Learnt& learnt);
  // What learn_from() would say.
  Status may_learn_from(const Learnt& learnt) const;
  // Makes every waiting frame ready; their windows may be solved as they are popped. The frame
  // after it belongs to a new window: time is broken.
  Status drain();
  // Drops all frames and forgets the window and the model.
  void flush();

  // Frames that are pushed before a frame leaves: EngineLayout::delay.
  int delay() const { return layout_.delay; }
  // Of the frames that wait, the next so many leave with the background that report() is about.
  int frames_left() const { return schedule_ ? schedule_->frames_left(queue_) : 0; }
  // Frames pushed and not popped.
  int pending() const { return queue_.pending; }
  // Scenes that began while frames came: the camera was moved, covered, or switched to another
  // view. Learning then began anew. Method::robust only.
  uint64_t scenes() const { return schedule_ ? schedule_->scenes() : 0; }
  uint64_t solves() const { return background_ ? background_->solves() : 0; }
  SolveReport report() const { return background_ ? background_->report() : SolveReport(); }
  // The bytes that count against max_memory: those of EngineLayout, and, once alpha varies or a
  // mask is soft, their own.
  uint64_t bytes() const;

  // A pixel is foreground above this quaternion norm; 0: from the noise. Takes effect at once.
  void set_foreground_threshold(double threshold);
  // Pixels to either side of a mask's edge over which Output::mask and cutout fade, 0 (hard) to
  // kMostSoftness. Takes effect at once; foreground() stays hard. Where configure() was told of
  // none, the first soft mask takes memory that max_memory does not know of.
  void set_mask_softness(int pixels) { options_.mask_softness = pixels; }
  // Where nothing is foreground, and masks learn nothing. Of the frame that pop() gives next; and
  // of a window whose last frame push() takes next: of its statistics, and of what batch learns
  // from its first one. Takes effect at once. The background is learnt there as everywhere.
  void set_ignored(const IgnoredAreas& areas);
  // Whether somebody is going to ask for masks, cut-outs or foreground(). If not, batch saves the
  // time in which it learns, from its first window, what masks need; who asks all the same has
  // masks that learn as frames are decided. True unless it is set.
  void set_masks_expected(bool expected);
  // Frames that something which came and stands still is foreground before it is background; 0: it
  // never is. What leaves is known at once. Takes effect with the next frame. Method::robust only.
  void set_absorb_frames(int64_t frames);
  // What masks make of pixels that only light tells from the background. Takes effect at once.
  void set_shadows(Shadows shadows);
  // While on, pop() and foreground() give the steady picture: frames, masks and backgrounds as they
  // are on the canvas. Takes effect at once. EngineOptions::stabilize.
  void set_stabilize_output(bool stabilize) { stabilize_output_ = stabilize; }
  // Where the camera looked in the newest frame that was pushed, and in that which pop() gives next
  // (at rest where none waits).
  Pose newest_pose() const { return stabilizer_ ? stabilizer_->motion() : Pose(); }
  Pose next_pose() const;
  // How often the camera went on, further than an eighth of the picture, to another view.
  uint64_t views() const { return stabilizer_ ? stabilizer_->views() : 0; }
  // max_memory has no room to hold frames of a camera that moves: they are taken as they come.
  bool has_no_room_for_motion() const { return schedule_ && schedule_->has_no_room(); }
  // While on, the background stays the picture that it was, and nothing is solved; only the first
  // model is made all the same. Batch: decided when a window begins.
  void set_freeze(bool freeze) { freeze_ = freeze; }
  // Seconds that a frame may take on average; 0: no limit. Solves are given the effort that fits,
  // at most what the options say (TimeBudget), and pictures then depend on time.
  void set_time_budget(double seconds_per_frame) { pace_.set_budget(seconds_per_frame); }
  const TimeBudget& time_budget() const { return pace_.budget(); }
  // Where the caller charges what a frame takes beside push() and pop(), for instance to be
  // converted: it counts.
  Clock& clock() { return clock_; }
  // As EngineOptions::threads. Takes effect with a frame that finds no solve under way. More
  // threads than configure() was told of take memory that max_memory does not know of.
  void set_threads(int threads);

 private:
  OutputTask task_of(Output output);
  OutputTask next_task(Output output);
  void return_to_frame(OutputTask* task, bool level);
  void decide_next(OutputTask* task);
  void soften(const Levels& levels, OutputTask* task);
  void pass_wishes();
  Status alpha_refused() const;
  template <typename Action>
  auto flushed_if_it_throws(Action action);

  EngineOptions options_;
  EngineLayout layout_;
  Clock clock_;
  Pace pace_{&clock_};
  bool freeze_ = false, masks_expected_ = true;
  int64_t absorb_frames_ = 0;
  IgnoredAreas ignored_;
  Shadows shadows_ = Shadows::background;
  bool stabilize_output_ = false;
  FrameStore frames_;
  std::unique_ptr<Stabilizer> stabilizer_;
  std::unique_ptr<Restorer> restorer_;
  std::unique_ptr<Background> background_;
  std::unique_ptr<SoftMask> soft_mask_;
  std::unique_ptr<Schedule> schedule_;
  Queue queue_;
  bool decided_ = false, softened_ = false;  // the frame that leaves next
  // The last member: its threads end before what they work on.
  std::unique_ptr<Workers> workers_;
};

}  // namespace qdmd
