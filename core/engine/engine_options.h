// What the engine is asked for, and why it refuses.
#pragma once

#include <cstdint>
#include <string>

#include "core/align/stabilizer.h"
#include "core/base/levels.h"
#include "core/base/status.h"
#include "core/engine/live_plan.h"
#include "core/foreground/decision.h"
#include "core/learn/learner.h"
#include "core/parallel/band.h"
#include "core/parallel/workers.h"

namespace qdmd {

enum class Mode {
  batch,  // frames come out a window at a time, each against its own window's model
  live    // each frame comes out at once, against the newest model
};

struct EngineOptions : LearnOptions {
  Mode mode = Mode::batch;
  int window_size = 100;                    // m, kMinWindow .. kMaxWindow frames
  int hop_size = 0;                         // frames between solves in live mode, up to m; 0: m / 4
  Colours colours = Colours::rgb;           // of the frames
  Levels levels;                            // of the frames
  DecisionSteps steps;                      // of masks
  double foreground_threshold = 0;          // grey levels, quaternion norm; 0: from the noise
  Stabilize stabilize = Stabilize::off;     // how the camera may move
  int mask_softness = 0;                    // pixels, Engine::set_mask_softness()
  uint64_t max_memory = uint64_t{4} << 30;  // bytes that the window and its models may take
  int threads = 0;                          // up to kMaxThreads; 0: all cores. Changes no result
  // Processes that have the other rows of the frames, one Engine each, all with the same options;
  // or null. Batch mode, `stabilize` off, hard masks, windows that do not remember others, and no
  // solver that reads pixels.
  Team* team = nullptr;
  double frame_rate = 0;  // frames per second at which they come; 0: unknown, or as they are wanted

  static constexpr int kMinWindow = 2, kMaxWindow = 2048, kMaxThreads = Workers::kMost;
};

// What options and frame size come to.
struct EngineLayout {
  int delay = 0;        // frames that a frame waits for: batch: window_size - 1 and late_frames
  int late_frames = 0;  // frames that arrive while a window is solved and is still needed
  int capacity = 0;     // frames that are kept
  int sample_step = 1;
  uint64_t frame_bytes = 0;  // of the planes of the frames that are kept
  uint64_t store_bytes = 0;  // of these and of all that belongs to a frame
  uint64_t soft_bytes = 0;   // of soft masks
  uint64_t bytes = 0;        // of these and of all else that is taken, at most at once
};
// Bytes are UINT64_MAX, and the rest is nothing, where there are too many pixels.
EngineLayout layout_of(const EngineOptions& options, int width, int height);

// The rows that this process has of frames of that size: it pushes those that are kept, and has
// pictures of its own ones. Without a team: all.
Band band_of(const EngineOptions& options, int width, int height);

// The learner of these options. Frames that a camera's movement moves share no samples, which only
// a learner whose solves are one piece can meet while frames come.
std::unique_ptr<Learner> learner_of(const EngineOptions& options, int width, int height);

// Models of batch and live mode.
Models models_of(Mode mode, int late_frames);

// Of live mode, for frames of that size.
LivePlan plan_of(const EngineOptions& options, int width, int height);

// Ok where an engine can be configured so.
Status check_options(const EngineOptions& options, int width, int height);

// "100 frames of 640x480".
std::string describe(const EngineOptions& options, int width, int height);

}  // namespace qdmd
