// SPDX-License-Identifier: LGPL-2.1-or-later
// How a window's background is found, and what that is asked for.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "core/base/colours.h"
#include "core/base/levels.h"
#include "core/dmd/options.h"

namespace qdmd {

enum class Method {
  qdmd,   // quaternion DMD, the paper's Algorithm 2
  dmd,    // exact DMD of each colour channel by itself, the paper's Algorithm 1
  robust  // the paper's Algorithm 2 on a window without its foreground (RobustLearner)
};

struct LearnOptions {
  Method method = Method::robust;
  DmdOptions dmd;
  int iterations = 1;  // of Method::robust, 1 .. kMaxIterations
  // The decomposition sees every k-th pixel in x and y, up to kMaxSampleStep; 0: chosen.
  int sample_step = 0;
  Colours colours = Colours::rgb;  // of the frames
  Levels levels;                   // of the frames
  int depth = 8;                   // bits of the frames' samples, 8 to 16
  // Pixels that share a sample of channels 1 and 2 in all frames, as in ChromaShape. 1: each has
  // its own, or frames differ, which takes more memory. Others than Y, U and V are not shared.
  int chroma_columns = 1, chroma_rows = 1;
  // Where each of several processes has some rows of the same pictures (Method::qdmd and dmd): the
  // picture's row that is the frames' first one, a multiple of chroma_rows; and what makes each
  // number the sum of all processes', which call it alike. Backgrounds are then those of the whole
  // picture, to the last bit, and all else is of the own rows. Empty: frames are whole pictures.
  int first_row = 0;
  std::function<void(std::span<int64_t>)> add;

  static constexpr int kMostDepth = 16;
  // Such samples are kept once.
  bool keeps_shared() const { return chroma_columns > 1; }
  static constexpr int kMaxSampleStep = 64, kMaxIterations = 20;
};

// The names, as users write them, of the options above that a method does not look at.
std::span<const char* const> options_without_effect(Method method);

}  // namespace qdmd
