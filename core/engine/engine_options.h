// SPDX-License-Identifier: LGPL-2.1-or-later
// What an engine is asked for when it begins.
#pragma once

#include <cstdint>
#include <string>

#include "core/align/stabilizer.h"
#include "core/base/levels.h"
#include "core/engine/wishes.h"
#include "core/foreground/decision_steps.h"
#include "core/learn/learner.h"
#include "core/parallel/workers.h"

namespace qdmd {

enum class Mode {
  batch,  // frames come out a window at a time, each against its own window's model
  live    // each frame comes out at once, against the newest model
};

// With the wishes for pictures that hold until others are given.
struct EngineOptions : LearnOptions, PictureWishes {
  Mode mode = Mode::batch;
  int window_size = 100;                    // m, kMinWindow .. kMaxWindow frames
  int hop_size = 0;                         // frames between solves in live mode, up to m; 0: m / 4
  DecisionSteps steps;                      // of masks
  Stabilize stabilize = Stabilize::off;     // how the camera may move
  uint64_t max_memory = uint64_t{4} << 30;  // bytes that the window and its models may take
  std::string window_on_disk;  // a folder, where the window's frames lie in a file; "": in memory
  int threads = 0;             // up to kMaxThreads; 0: all cores. Changes no result
  double frame_rate = 0;  // frames per second at which they come; 0: unknown, or as they are wanted
  // 1, 2 or 4: all is learnt and decided in a picture that is so many times smaller in each
  // direction (FrameReducer), and pictures are enlarged (Enlarger). A choice for who wants masks
  // alone: Reduction::automatic_scale().
  int mask_scale = 1;

  static constexpr int kMinWindow = 2, kMaxWindow = 2048, kMaxThreads = Workers::kMost;
};

// All wishes as they are when an engine begins.
inline Wishes first_wishes(const EngineOptions& options) {
  Wishes wishes;
  static_cast<PictureWishes&>(wishes) = options;
  wishes.threads = options.threads;
  return wishes;
}

}  // namespace qdmd
