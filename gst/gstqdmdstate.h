// What qdmdbackground keeps from one call to the next.
#pragma once

#include <gst/video/gstvideofilter.h>

#include <mutex>
#include <vector>

#include "core/engine/engine.h"
#include "gst/backgroundsample.h"
#include "gst/frameio.h"
#include "gst/gstqdmdbackground.h"
#include "gst/gstqdmdsettings.h"
#include "gst/latency.h"
#include "gst/pointers.h"
#include "gst/solvereport.h"

namespace qdmd {

struct State {
  // Protected by the object lock.
  Settings settings;
  Latency latency;  // written with the stream lock, too
  Counters counters;
  bool reset_asked = false;
  SolveReport report;

  // Held while the engine works, by the streaming thread and by a thread that reads `background`;
  // never while something is pushed, queried or posted. The object lock may be taken inside it.
  std::mutex engine_lock;
  // Protected by the engine lock.
  Engine engine;
  FrameIo io;
  BackgroundSample background;

  // Protected by the stream lock.
  // The metadata of the frames that the engine holds, oldest first: buffers without memory, so that
  // upstream's pools never wait for a window.
  BufferQueue shells;
  std::vector<guint8> mask, residual;  // for regions
  guint64 solves_told = 0;             // of the engine's
  guint breaks = 0;                    // in time, one after another, with a frame between them
  bool warned_of_breaks = false;
  gint64 came = 0;   // the newest frame, in microseconds of the system's clock
  guint warned = 0;  // settings without effect, a bit for each id
  GstClockTime next_pts = GST_CLOCK_TIME_NONE;  // where the frame after the newest is expected
};

}  // namespace qdmd

// What GLib aligns instances to.
static_assert(alignof(qdmd::State) <= 16);
struct _GstQdmdBackground {
  GstVideoFilter parent;
  // In the instance's own memory: GLib ends the process where it has none.
  qdmd::State* state;
  alignas(qdmd::State) unsigned char room_of_state[sizeof(qdmd::State)];
};
