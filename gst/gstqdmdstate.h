// What qdmdbackground keeps from one call to the next.
#pragma once

#include <gst/video/gstvideofilter.h>

#include <memory>
#include <mutex>
#include <vector>

#include "core/engine/engine.h"
#include "core/foreground/regions.h"
#include "core/model/learnt.h"
#include "gst/backgroundsample.h"
#include "gst/gstqdmdbackground.h"
#include "gst/gstqdmdsettings.h"
#include "gst/latency.h"
#include "gst/pointers.h"
#include "gst/solvereport.h"

namespace qdmd {

// What was loaded and waits for the video that it is of.
struct Loaded {
  Learnt learnt;
  CharsPtr file;          // its name, to be shown
  bool at_start = false;  // by load-location: the element does not go on without it
};

struct State {
  // Protected by the object lock.
  Settings settings;
  Latency latency;  // written with the stream lock, too
  Counters counters;
  bool reset_asked = false;
  SolveReport report;
  CharsPtr load_location;

  // Held while the engine works, by the streaming thread and by a thread that reads `background`;
  // never while something is pushed, queried or posted. The object lock may be taken inside it.
  std::mutex engine_lock;
  // Protected by the engine lock.
  Engine engine;
  BackgroundSample background;
  Colours colours = Colours::rgb;  // of the video that the engine is configured for
  std::unique_ptr<Loaded> loaded;

  // Protected by the stream lock.
  // The metadata of the frames that the engine holds, oldest first: buffers without memory, so that
  // upstream's pools never wait for a window.
  BufferQueue shells;
  std::vector<guint8> mask, residual;  // for regions
  RegionFinder regions;
  guint64 solves_told = 0, scenes_told = 0, views_told = 0;  // of the engine's
  guint breaks = 0;  // in time, one after another, with a frame between them
  bool warned_of_breaks = false, warned_of_no_room = false;
  bool camera_moved = false;                    // in the frame that left last
  guint warned = 0;                             // settings without effect, a bit for each id
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
