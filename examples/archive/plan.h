// SPDX-License-Identifier: LGPL-2.1-or-later
// How a recording is shared out: stretches of it, which processes separate one by one.
#pragma once

#include <gst/video/video.h>

#include <cstdint>
#include <string>
#include <vector>

#include "examples/archive/frame_reader.h"

namespace qdmd::archive {

// Frames that follow each other. Those to warm up come before, and are not written.
struct Stretch {
  int64_t first = 0, frames = 0, warm_up = 0;  // frames: of the last one, as many as are left
  Place place;
  // Where frames can be found by time: when the first one to warm up is shown, the stretch's own
  // first one, and the first behind it (none: all that follow are its own). Else these are found by
  // number, from the recording's first frame on.
  GstClockTime warm_up_time = 0, first_time = 0, end_time = GST_CLOCK_TIME_NONE;
};

struct Plan {
  std::string settings;  // what results depend on, but for this plan
  std::string job;       // who began it
  std::string caps;      // of frames
  bool by_time = false;
  bool joined = false;  // results are whole, and what they were made of may be gone
  int64_t frames = 0;   // in all; 0: nobody knows
  std::vector<Stretch> stretches;
  std::vector<std::string> early_ends;  // FrameIndex::early_end of the files
};

struct PlanOptions {
  std::vector<std::string> recordings;
  double rate = 25;      // of pictures, frames a second
  int window = 0;        // stretches begin where windows do
  int64_t stretch = 0;   // frames; 0: chosen
  int64_t warm_up = -1;  // frames; below 0: chosen
  int processes = 1;     // that share the recording
};

// Finds the frames of a recording and shares them out; settings and job are the caller's. Throws
// std::runtime_error with a sentence for the user.
Plan make_plan(const PlanOptions& options);

// As a file's text, and back; throws std::exception where it is no plan.
std::string text_of(const Plan& plan);
Plan plan_of(const std::string& text);

// The frames that caps describe.
GstVideoInfo info_of(const std::string& caps);

}  // namespace qdmd::archive
