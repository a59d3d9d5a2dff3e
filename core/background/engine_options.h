// What the engine is asked for, and why it refuses.
#pragma once

#include <cstdint>
#include <string>

#include "core/background/live_schedule.h"
#include "core/dmd/options.h"

namespace qdmd {

enum class Mode {
  batch,  // frames come out a window at a time, each against its own window's model
  live    // each frame comes out at once, against the newest model
};

struct EngineOptions {
  Mode mode = Mode::batch;
  int window_size = 100;  // m, kMinWindow .. kMaxWindow frames
  int hop_size = 0;       // frames between solves in live mode, up to m; 0: m / 4
  DmdOptions dmd = {.method = Method::robust};
  int iterations = 1;  // of Method::robust, 1 .. kMaxIterations
  // The decomposition sees every k-th pixel in x and y, up to kMaxSampleStep; 0: chosen.
  int sample_step = 0;
  double foreground_threshold = 0;          // grey levels, quaternion norm; 0: from the noise
  uint64_t max_memory = uint64_t{4} << 30;  // bytes that the window may take
  int threads = 0;                          // up to kMaxThreads; 0: all cores. Changes no result

  static constexpr int kMinWindow = 2, kMaxWindow = 2048, kMaxThreads = 256, kMaxSampleStep = 64,
                       kMaxIterations = 20;
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

// What options and frame size come to.
struct EngineLayout {
  int capacity = 0;  // frames that are kept: the window's, in live mode also those that arrive
                     // while one is solved
  int sample_step = 1;
  uint64_t frame_bytes = 0;  // of the frames that are kept
  uint64_t bytes = 0;        // of these and of what grows with them beside
};
EngineLayout layout_of(const EngineOptions& options, int width, int height);

// Of live mode, for frames of that many pixels.
LiveSchedule schedule_of(const EngineOptions& options, size_t pixels);

// Ok where an engine can be configured so.
Status check_options(const EngineOptions& options, int width, int height);

}  // namespace qdmd
