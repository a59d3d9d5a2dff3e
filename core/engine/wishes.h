// SPDX-License-Identifier: LGPL-2.1-or-later
// What a caller may wish anew with each frame.
#pragma once

#include <cstdint>

#include "core/base/ignored_areas.h"
#include "core/foreground/decision.h"

namespace qdmd {

// What push() takes, for all that is learnt from then on.
struct LearnWishes {
  // The background stays the picture that it is, and nothing is solved. If there is no model yet, a
  // first one is made all the same. Batch: decided when a window begins.
  bool freeze = false;
  // False: nobody is going to ask for masks, cut-outs or LeavingFrame::foreground(). Batch then
  // saves the time in which it learns from its first window for masks. If you ask for masks all the
  // same, they learn from frame to frame.
  bool masks_expected = true;
  // Something that came and stands still is foreground for so many frames and then becomes
  // background; 0: it never does. Something that leaves is noticed at once. Method::robust only.
  int64_t absorb_frames = 0;
  // Seconds that a frame may take on average; 0: no limit. Each solve gets the effort that fits
  // (TimeBudget), at most as much as the options say. Pictures then depend on time.
  double time_budget = 0;
  // Threads that work, as EngineOptions::threads. Holds from the first frame on that comes while no
  // solve is under way. If these are more threads than in the options, their memory does not count
  // against max_memory.
  int threads = 0;
};

// What next() takes, for the frame that leaves and what masks learn from then on.
struct PictureWishes {
  // A pixel is foreground above this quaternion norm, in grey levels; 0: from the noise.
  double foreground_threshold = 0;
  // What pixels become in masks if they are the background in another light.
  Shadows shadows = Shadows::background;
  // Pixels to either side of a mask's edge over which Output::mask and cutout fade, 0 (hard) to
  // kMostSoftness. LeavingFrame::foreground() stays hard. If the options had 0, the first soft mask
  // takes memory that does not count against max_memory.
  int mask_softness = 0;
  // Pictures are the steady ones: frames, masks and backgrounds as they are on the canvas
  // (EngineOptions::stabilize).
  bool stabilize_output = false;
};

// A caller's wishes hold until others are given.
struct Wishes : LearnWishes, PictureWishes {
  // Both take it: areas in which nothing is foreground, and masks learn nothing. They hold for the
  // frame that leaves; for the statistics of the window whose last frame is pushed; and, in batch,
  // for what masks learn from the first window. The background is learnt there as everywhere.
  IgnoredAreas ignored = {};
};

}  // namespace qdmd
