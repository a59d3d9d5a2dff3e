// SPDX-License-Identifier: LGPL-2.1-or-later
// How long a frame waits in qdmdbackground: what it answers a LATENCY query.
#pragma once

#include <gst/gst.h>

namespace qdmd {

// In frames, from the engine; in time, from the caps' rate, and from timestamps where frames come
// more slowly than that; and what a solve held frames up. Only grows until configure(). Calls are
// from one thread, with a lock around those that write.
class Latency {
 public:
  // That of video without a rate, in frames per second.
  static constexpr gint kAssumedRate = 25;

  // A frame waits for `frames` others, 1 / rate seconds each (unknown: 0/1). True:
  // another latency than before.
  bool configure(guint64 frames, gint rate_n, gint rate_d);
  // The next frame is the first after a break. What was promised stays.
  void restart() {
    intervals_ = 0;
    span_ = 0;
    first_ = newest_ = GST_CLOCK_TIME_NONE;
    pause_ = paused_ = false;
  }
  // No frame came for long before the next one: that is no frame's time, unless it is so between
  // all of them.
  void pause() { pause_ = true; }
  // Frames per second: of the frames since the last break, where they have timestamps, else of the
  // caps (unknown: 0/1). Pauses do not count, nor do steps back.
  double rate(gint rate_n, gint rate_d) const;
  GstClockTime promised() const { return promised_; }
  // To a LATENCY query whose answer from upstream is `min` to `max` (GST_CLOCK_TIME_NONE: any), the
  // answer to downstream.
  void add_to(bool live, GstClockTime* min, GstClockTime* max) const;

  // Each returns true where the promise grew: a LATENCY message is due.
  // A frame came, after the one before in time.
  bool frame_in(GstClockTime timestamp);
  // A solve held the newest frame up for `held`, and whichever frame leaves with it, if one does:
  // the next solve is promised to.
  bool held_up(GstClockTime held);
  // The frame of that timestamp leaves; a solve held it up for `held` (0: none did) after the
  // newest came.
  bool frame_out(GstClockTime timestamp, GstClockTime held);

 private:
  bool promise(GstClockTime latency);

  guint64 frames_ = 0;
  GstClockTime promised_ = 0;
  GstClockTime frames_time_ = 0;  // of what was promised, what `frames_` take by themselves
  // The earliest timestamp since the last break or pause, and that of the newest frame.
  GstClockTime first_ = GST_CLOCK_TIME_NONE, newest_ = GST_CLOCK_TIME_NONE;
  guint64 intervals_ = 0;                // between frames, since the last break
  GstClockTime span_ = 0;                // of these
  bool pause_ = false, paused_ = false;  // before the next frame, and before the newest
};

}  // namespace qdmd
