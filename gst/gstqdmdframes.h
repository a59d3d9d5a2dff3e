// Frames of qdmdbackground on their way through the engine, with their metadata.
#pragma once

#include <gst/video/gstvideofilter.h>

#include <deque>
#include <memory>
#include <vector>

#include "core/background/engine.h"
#include "gst/frameio.h"
#include "gst/gstqdmdbackground.h"
#include "gst/gstqdmdsettings.h"
#include "gst/solvereport.h"

namespace qdmd {

struct UnrefBuffer {
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
};
using BufferPtr = std::unique_ptr<GstBuffer, UnrefBuffer>;

struct UnrefSample {
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
};
using SamplePtr = std::unique_ptr<GstSample, UnrefSample>;

// What the element keeps.
struct Frames {
  // Protected by the object lock.
  Settings settings;
  GstClockTime latency = 0;
  Counters counters;
  bool reset_asked = false;
  SolveReport report;
  SamplePtr background;

  // Protected by the stream lock.
  Engine engine;
  // The metadata of the frames that the engine holds, oldest first: buffers without memory, so that
  // upstream's pools never wait for a window.
  std::deque<BufferPtr> shells;
  FrameIo io;
  std::vector<guint8> mask, residual;  // for regions
  guint64 solves_told = 0;
  GstClockTime next_pts = GST_CLOCK_TIME_NONE;  // where the frame after the newest is expected
};

// Calls are from the streaming thread, with the stream lock and without the object lock. Errors are
// posted.

// Makes the engine ready for frames of `info`. False: an error was posted.
bool configure(GstQdmdBackground* self, const Settings& settings, const GstVideoInfo& info);
// Drops what waits and forgets the background.
void drop_frames(GstQdmdBackground* self);
// Before a frame: what waits is sent where time breaks or somebody asked for a reset.
GstFlowReturn prepare_for(GstQdmdBackground* self, GstBuffer* input);
// Takes a frame of the negotiated caps.
GstFlowReturn take_frame(GstQdmdBackground* self, BufferPtr buffer);
// The next ready frame as a buffer from the output pool, or null with OK where none is ready.
GstFlowReturn next_output(GstQdmdBackground* self, GstBuffer** out);
// Solves for what is left and pushes it; the next frame begins a new window.
GstFlowReturn drain(GstQdmdBackground* self);

}  // namespace qdmd

struct _GstQdmdBackground {
  GstVideoFilter parent;
  qdmd::Frames* frames;
};
