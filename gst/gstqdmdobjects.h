// SPDX-License-Identifier: LGPL-2.1-or-later
// The things of an element's stream: regions with numbers on its buffers, and messages about them.
#pragma once

#include <gst/video/video.h>

#include <vector>

#include "core/engine/leaving_frame.h"
#include "core/foreground/regions.h"
#include "core/objects/object_tracker.h"
#include "gst/gstqdmdsettings.h"
#include "gst/pointers.h"

namespace qdmd {

// What the element's streaming thread asks of it, with the stream lock; frames in the order in
// which they leave.
class ObjectWatch {
 public:
  // For video of that size. Numbers go on. live: frames leave as they come, so that what was
  // uncovered is known with them.
  void begin(const GstVideoInfo& info, bool live);
  // The element starts: numbers begin at 1.
  void begin_numbers() { tracker_.begin_numbers(); }
  // Gives all memory back. Nothing is followed any more.
  void close();

  // What leaves is looked at, with the engine lock: its regions are found, and what becomes of
  // things. timestamp: of the frame. May throw std::bad_alloc.
  void look(LeavingFrame* frame, const Settings& settings, const GstSegment& segment,
            GstClockTime timestamp);
  // Attaches the regions of the frame that was looked at last, if the settings want them.
  void attach(GstBuffer* buffer) const;
  // Posts what became of things with it; without locks. info: of the frames.
  void tell(GstElement* element, const GstVideoInfo& info);
  // The stream ends, or goes on somewhere else: what appeared is gone, cut off. Without locks.
  void cut_off(GstElement* element);

 private:
  // Times of a frame: what messages say, and the tracker's clock, which does not go back.
  struct Times {
    GstClockTime timestamp = GST_CLOCK_TIME_NONE, running = GST_CLOCK_TIME_NONE,
                 stream = GST_CLOCK_TIME_NONE;
    gint64 clock = 0;
  };
  void follow_time(const GstSegment& segment, GstClockTime timestamp);
  void post(GstElement* element, const ObjectEvent& event, GstSample* snapshot) const;
  GstSample* snapshot_of(const ObjectBox& box, const GstVideoInfo& info) const;

  GstVideoInfo info_ = {};
  std::vector<guint8> mask_, residual_;
  RegionFinder finder_;
  ObjectTracker tracker_;
  std::vector<RemovedPlace> removed_;
  std::vector<ObjectEvent> events_;   // that wait for tell()
  BufferPtr frame_;                   // that the events are of, where somebody wants snapshots
  std::vector<const Object*> shown_;  // the regions to attach, the largest first
  Times now_;
  bool live_ = false, any_ = false, tells_ = false, attaches_ = false;
  int least_area_ = 0;  // of regions that are attached
};

}  // namespace qdmd
