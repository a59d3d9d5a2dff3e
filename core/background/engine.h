// The background separator: frames in, pictures out. No GStreamer.
#pragma once

#include <memory>
#include <optional>

#include "core/background/alpha_store.h"
#include "core/background/engine_options.h"
#include "core/background/live_solver.h"
#include "core/background/time_budget.h"
#include "core/parallel/side_thread.h"

namespace qdmd {

// Batch: push() collects window_size frames and solves; then pop() gives all of them back, in
// order, each against its own L(t). drain() solves for a remainder, on the last window_size frames
// seen (fewer where the stream is shorter). Live: each push() makes its frame ready, against the
// newest model, extrapolated to the frame's time. A solve on the last window_size frames begins
// every hop_size frames, earlier while the window fills up, and its work is spread over the frames
// that follow (LiveSchedule). drain() begins a new window and keeps the background as it is until
// there is a new model. Every frame pushed is popped exactly once, unless flush() drops it. Results
// do not depend on the number of threads or on time. Not thread safe. May throw std::bad_alloc.
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  // Starts afresh with frames of width x height pixels.
  Status configure(const EngineOptions& options, int width, int height);
  bool configured() const { return window_.capacity() > 0; }
  // Gives all memory and threads back; configure() comes next.
  void close();

  // Copies a frame in. Batch: solves when the window is full.
  Status push(const ImageView& frame);
  // True while pop() has a frame.
  bool ready() const { return ready_ > 0; }
  // Writes the next frame's picture. Call only while ready(); `out` has the configured size.
  void pop(Output output, const MutableImageView& out);
  // Of the frame that pop() gives next, width * height samples each: its mask, as Output::mask has
  // it, and the lengths of its residuals in levels, at most 255. Call only while ready().
  void foreground(uint8_t* mask, uint8_t* residual);
  // Writes the newest background: that of the newest frame pushed. False: there is none yet.
  bool write_background(const MutableImageView& out);
  // Makes every waiting frame ready. The frame after it belongs to a new window: time is broken.
  Status drain();
  // Drops all frames and forgets the window and the model.
  void flush();

  // Frames pushed and not popped.
  int pending() const { return pending_; }
  uint64_t solves() const { return solves_; }
  const SolveReport& report() const { return solver_.report(); }

  // A pixel is foreground above this quaternion norm; 0: from the noise. Takes effect at once.
  void set_foreground_threshold(double threshold);
  // While on, the background stays the picture that it was, and nothing is solved; only the first
  // model is made all the same. Batch: decided when a window begins.
  void set_freeze(bool freeze) { freeze_ = freeze; }
  // Seconds that a frame may take on average; 0: no limit. Solves are given the effort that fits,
  // at most what the options say (TimeBudget), and pictures then depend on time.
  void set_time_budget(double seconds_per_frame) { budget_.set(seconds_per_frame); }
  const TimeBudget& time_budget() const { return budget_; }
  // Seconds that a frame takes beside push() and pop(), for instance to be converted: they count.
  void add_time(double seconds) { stretch_seconds_ += seconds; }
  // As EngineOptions::threads. Takes effect with a frame that finds no solve under way.
  void set_threads(int threads) { threads_ = threads; }

 private:
  OutputTask next_task(Output output);
  void follow_threads();
  void take_in(const ImageView& frame);
  void push_batch(const ImageView& frame);
  void push_live(const ImageView& frame);
  void begin_stretch();
  void add_group(int frames);
  void solve();

  // Frames on their way into the Gram matrix.
  struct Group {
    SnapshotRange span;
    int frames;
  };

  EngineOptions options_;
  int width_ = 0, height_ = 0;
  std::unique_ptr<Pool> pool_;
  Window window_;
  AlphaStore alpha_;
  WindowSolver solver_;
  LiveSolver live_;
  uint64_t solves_ = 0;
  int pending_ = 0;             // the newest `pending_` frames of the window
  int ready_ = 0;               // how many of them may be popped
  int not_in_gram_ = 0;         // batch: newest frames whose inner products are not computed yet
  std::optional<Group> group_;  // batch: what the side thread is at
  bool has_model_ = false, start_new_window_ = false;
  bool freeze_ = false, frozen_ = false;  // as asked for, and as done
  int threads_ = 0;                       // as asked for; options_ has what is done

  TimeBudget budget_;
  // Of the stretch that runs: frames, seconds in push() and pop(), of which in a solve.
  int stretch_frames_ = 0;
  double stretch_seconds_ = 0, stretch_solve_ = 0;
  bool skip_solve_ = false;     // batch: the window that runs keeps the background...
  bool follows_light_ = false;  // ...but for its light

  // The last member: it ends before what it works on.
  std::unique_ptr<SideThread> side_;
};

}  // namespace qdmd
