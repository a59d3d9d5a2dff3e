// The background separator: frames in, pictures out, a window at a time. No GStreamer.
#pragma once

#include <memory>
#include <string>

#include "core/background/alpha_store.h"
#include "core/background/background_model.h"
#include "core/background/foreground.h"
#include "core/dmd/options.h"
#include "core/gram/gram.h"
#include "core/parallel/pool.h"

namespace qdmd {

struct EngineOptions {
  int window_size = 100;  // m, kMinWindow .. kMaxWindow frames
  DmdOptions dmd;
  double foreground_threshold = 0;          // grey levels, quaternion norm; 0: from the noise
  uint64_t max_memory = uint64_t{4} << 30;  // bytes that the window may take
  int threads = 0;  // for the Gram matrix, up to kMaxThreads; 0: all cores. Changes no result

  static constexpr int kMinWindow = 2, kMaxWindow = 2048, kMaxThreads = 256;
};

// Why a call was refused. The message is a sentence for the user that says what to change.
struct Status {
  enum class Code {
    ok,
    invalid_options,    // a value outside its range
    too_much_memory,    // the window (or the solver) needs more than max_memory
    not_configured,     // push or drain before configure
    frames_are_waiting  // push while frames are ready: pop them first
  };
  Code code = Code::ok;
  std::string message;

  bool ok() const { return code == Code::ok; }
};

// About the newest solve.
struct SolveReport {
  DmdSummary dmd;
  ForegroundStatistics foreground;
  int window_frames = 0;
  double gram_time = 0;   // seconds in the Gram matrix since the solve before
  double solve_time = 0;  // seconds in the decomposition
};

// Batch separation: push() collects window_size frames and solves; then pop() gives all of them
// back, in order, each against its own L(t). drain() solves for a remainder, on the last
// window_size frames seen (fewer where the stream is shorter). Every frame pushed is popped exactly
// once, unless flush() drops it. Not thread safe. May throw std::bad_alloc.
class Engine {
 public:
  // Starts afresh with frames of width x height pixels.
  Status configure(const EngineOptions& options, int width, int height);

  // Copies a frame in. Solves when the window is full.
  Status push(const ImageView& frame);
  // True while pop() has a frame.
  bool ready() const { return ready_ > 0; }
  // Writes the next frame's picture. Call only while ready(); `out` has the configured size.
  void pop(Output output, const MutableImageView& out);
  // Makes every waiting frame ready. The frame after it belongs to a new window: time is broken.
  Status drain();
  // Drops all frames and forgets the window.
  void flush();

  // Frames pushed and not popped.
  int pending() const { return pending_; }
  uint64_t solves() const { return solves_; }
  const SolveReport& report() const { return report_; }

  // A pixel is foreground above this quaternion norm; 0: from the noise. Takes effect at once.
  void set_foreground_threshold(double threshold);

 private:
  void update_gram(int count, int span);
  void solve();

  EngineOptions options_;
  int width_ = 0, height_ = 0;
  // Shared by all passes over pixels; made by configure().
  std::unique_ptr<Pool> pool_;
  Window window_;
  SlidingGram gram_;
  AlphaStore alpha_;
  BackgroundModel model_;
  SolveReport report_;
  int not_in_gram_ = 0;      // newest frames whose inner products are not computed yet
  double gram_seconds_ = 0;  // since the newest solve
  uint64_t solves_ = 0;
  int pending_ = 0;  // the newest `pending_` frames of the window
  int ready_ = 0;    // how many of them may be popped
  bool start_new_window_ = false;
};

}  // namespace qdmd
