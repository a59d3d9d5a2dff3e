// The background separator: frames in, pictures out. No GStreamer.
#pragma once

#include <memory>

#include "core/engine/engine_options.h"
#include "core/engine/schedule.h"
#include "core/foreground/picture.h"
#include "core/foreground/soft_mask.h"

namespace qdmd {

// Batch: push() collects window_size frames. The window is then solved, at once or beside the
// frames that follow. From then on one frame becomes ready with each push(), in order, delay()
// frames after it came, against its own window's L(t). drain() makes all frames ready. If an
// unfinished window is left, it is solved on the last window_size frames seen (or on fewer, if the
// stream is shorter).
// Live: each push() makes its frame ready, against the newest model, extrapolated to the frame's
// time. A solve on the last window_size frames begins every hop_size frames, and earlier while the
// window fills up. Its work is spread over the frames that follow (LivePlan). drain() begins a new
// window and keeps the background as it is until there is a new model.
// Every frame pushed is popped exactly once, unless flush() drops it. Results do not depend on the
// number of threads or on time, unless there is a time budget. Not thread safe. Throws
// std::bad_alloc if memory runs out: frames that wait are then lost, as after flush(), and the
// engine goes on with the next frame. If configure() throws it, the engine is not configured.
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  // Starts afresh with frames of width x height pixels. If a team shares them, push() then takes
  // the rows of band() that are kept, and pictures that are written have its own rows. If it
  // refuses, nothing has changed.
  Status configure(const EngineOptions& options, int width, int height);
  bool configured() const { return schedule_ != nullptr; }
  const Band& band() const { return frames_.band(); }
  // Gives all memory and threads back; configure() comes next.
  void close();

  // Copies a frame in.
  Status push(const ImageView& frame);
  // True if the newest push() took longer than one frame needs: it waited for a solve, or did work
  // of a solve itself, because no thread was free or because the solve was due.
  bool held_up() const { return schedule_ && schedule_->held_up(); }
  // True while pop() has a frame.
  bool ready() const { return queue_.ready > 0; }
  // Writes a picture of the next frame, which stays the next frame: any number of pictures can be
  // made from one computation. Call only while ready(); `out` has the configured size. `levels` are
  // its black, white and neutral chroma: the configured ones, or, for a mask in another format, the
  // levels of that format. Samples have the configured depth, or 8 bits: the highest ones.
  void write(Output output, const Levels& levels, const MutableImageView& out);
  // The mask of the frame that leaves next, of the whole picture, even if a team shares it: 255
  // where foreground, else 0, width * height samples in row order. Good until skip(). Null unless
  // ready().
  const uint8_t* whole_mask();
  // The next frame leaves. Call it once its pictures are written, if anybody wants some, and only
  // while ready().
  void skip();
  // write() in the configured levels, and skip().
  void pop(Output output, const MutableImageView& out);
  // Gives the mask of the frame that leaves next, as in Output::mask, and the lengths of its
  // residuals in levels, at most 255; width * height samples each. Call only while ready().
  void foreground(uint8_t* mask, uint8_t* residual);
  // Writes the newest background. Batch: the background of the last frame of the newest solved
  // window. Live: of the frame with which the newest model came. While a background is held: that
  // one. False: there is none yet.
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
  // another; nothing has changed then. Waits and throws like learnt().
  Status learn_from(const Learnt& learnt);
  // The status that learn_from() would return.
  Status may_learn_from(const Learnt& learnt) const;
  // Makes every waiting frame ready; windows may be solved as their frames are popped. The next
  // frame that is pushed begins a new window.
  Status drain();
  // Drops all frames and forgets the window and the model.
  void flush();
  // No frame waits: windows to come know nothing of those before, but if one of them ends early, it
  // has their frames. Batch only.
  void begin_anew();

  // Frames that are pushed before a frame leaves: EngineLayout::delay.
  int delay() const { return layout_.delay; }
  // So many of the frames that wait leave with the background that report() is about.
  int frames_left() const { return schedule_ ? schedule_->frames_left(queue_) : 0; }
  // Frames pushed and not popped.
  int pending() const { return queue_.pending; }
  // Scenes that began while frames came: the camera was moved, covered, or switched to another
  // view. Learning then began anew. Method::robust only.
  uint64_t scenes() const { return schedule_ ? schedule_->scenes() : 0; }
  uint64_t solves() const { return background_ ? background_->solves() : 0; }
  SolveReport report() const { return background_ ? background_->report() : SolveReport(); }
  // The bytes that count against max_memory: the bytes of EngineLayout, and the bytes for alpha
  // that varies and for soft masks once there are any.
  uint64_t bytes() const;

  // A pixel is foreground above this quaternion norm; 0: from the noise. Takes effect at once.
  void set_foreground_threshold(double threshold);
  // Pixels to either side of a mask's edge over which Output::mask and cutout fade, 0 (hard) to
  // kMostSoftness. Takes effect at once; foreground() stays hard. If the options of configure()
  // had 0, the first soft mask takes memory that does not count against max_memory.
  void set_mask_softness(int pixels) { options_.mask_softness = pixels; }
  // Areas in which nothing is foreground, and masks learn nothing. They hold for the frame that
  // pop() gives next; for the statistics of the window whose last frame push() takes next; and, in
  // batch, for what masks learn from the first window. Takes effect at once. The background is
  // learnt there as everywhere.
  void set_ignored(const IgnoredAreas& areas);
  // False: nobody is going to ask for masks, cut-outs or foreground(). Batch then saves the time
  // in which it learns from its first window for masks. If you ask for masks all the same, they
  // learn from frame to frame. True unless it is set.
  void set_masks_expected(bool expected);
  // Something that came and stands still is foreground for so many frames and then becomes
  // background; 0: it never does. Something that leaves is noticed at once. Takes effect with the
  // next frame. Method::robust only.
  void set_absorb_frames(int64_t frames);
  // What pixels become in masks if they are the background in another light. Takes effect at once.
  void set_shadows(Shadows shadows);
  // While on, pop() and foreground() give the steady picture: frames, masks and backgrounds as they
  // are on the canvas. Takes effect at once. EngineOptions::stabilize.
  void set_stabilize_output(bool stabilize) { stabilize_output_ = stabilize; }
  // Where the camera looked in the newest frame that was pushed, and in that which pop() gives next
  // (at rest where none waits).
  Pose newest_pose() const { return stabilizer_ ? stabilizer_->motion() : Pose(); }
  Pose next_pose() const;
  // How often the camera moved further than an eighth of the picture, to another view.
  uint64_t views() const { return stabilizer_ ? stabilizer_->views() : 0; }
  // True if max_memory has no room for a second copy of frames that are moved: frames are then
  // taken as they come.
  bool has_no_room_for_motion() const { return schedule_ && schedule_->has_no_room(); }
  // While on, the background stays the picture that it is, and nothing is solved. If there is no
  // model yet, a first one is made all the same. Batch: decided when a window begins.
  void set_freeze(bool freeze) { freeze_ = freeze; }
  // Seconds that a frame may take on average; 0: no limit. Each solve gets the effort that fits
  // (TimeBudget), at most as much as the options say. Pictures then depend on time.
  void set_time_budget(double seconds_per_frame) { pace_.set_budget(seconds_per_frame); }
  const TimeBudget& time_budget() const { return pace_.budget(); }
  // Here the caller charges the time that a frame takes beside push() and pop(), for instance for a
  // conversion. It counts in the time budget.
  Clock& clock() { return clock_; }
  // As EngineOptions::threads. Takes effect with the first frame that comes while no solve is under
  // way. If these are more threads than in the options of configure(), their memory does not count
  // against max_memory.
  void set_threads(int threads);

 private:
  OutputTask task_of(Output output);
  OutputTask next_task(Output output);
  void return_to_frame(OutputTask* task, bool level);
  void name_planes(int slot, OutputTask* task);
  void read_next();
  void decide_next(OutputTask* task);
  void soften(OutputTask* task);
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
  // Of the frame that leaves next.
  bool decided_ = false, softened_ = false, read_ = false;
  PlaneRows next_;
  std::unique_ptr<uint8_t[]> next_chroma_;  // of each pixel, where pixels share samples
  // The last member: its threads end before what they work on.
  std::unique_ptr<Workers> workers_;
};

}  // namespace qdmd
