// SPDX-License-Identifier: LGPL-2.1-or-later
// What a solve found, as GStreamer structures.
#pragma once

#include <gst/gst.h>

#include "core/engine/background.h"

namespace qdmd {

struct Counters {
  guint64 frames_in = 0, frames_out = 0, solves = 0;
  // What the time budget came to: of so many windows (live: hops) one is solved, and milliseconds
  // for each frame.
  guint solve_period = 1;
  double time_per_frame = 0;
  Pose camera;  // of the newest frame that came in
};

// The property `stats`.
GstStructure* make_stats(const SolveReport& report, const Counters& counters);

// The first background that can be trusted: the camera has found its exposure.
GstStructure* make_ready_message(const GstSegment& segment, GstClockTime timestamp);

// The element message of a solve. timestamp and duration: of the frames that come out with it.
GstStructure* make_solve_message(const SolveReport& report, const Counters& counters,
                                 const GstSegment& segment, GstClockTime timestamp,
                                 GstClockTime duration);

// The element message of another scene, noticed with the frame of that timestamp. camera_moved: the
// camera went on to it.
GstStructure* make_scene_message(const GstSegment& segment, GstClockTime timestamp,
                                 bool camera_moved);

// The element message of where the camera looked in the frame of that timestamp.
GstStructure* make_camera_message(const GstSegment& segment, GstClockTime timestamp,
                                  const Pose& camera);

}  // namespace qdmd
