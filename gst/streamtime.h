// SPDX-License-Identifier: LGPL-2.1-or-later
// What timestamps say: whether frames are missing, or time has jumped.
#pragma once

#include <gst/gst.h>

namespace qdmd {

// Of the frames of a stream, in the order in which they come. Frames without timestamps say
// nothing.
class StreamTime {
 public:
  enum class Step {
    onwards,  // as far as anybody knows; some frames may be missing, or a clock was corrected
    gap,      // onwards, by more than the time of some lost frames
    jump      // back, by a second or more
  };

  void forget() { newest_ = GST_CLOCK_TIME_NONE; }
  // From the frame before to the one of this timestamp. frame: how long frames last;
  // GST_CLOCK_TIME_NONE: nobody knows, and no step is a gap. In reverse playback on is back.
  Step step_to(GstClockTime timestamp, GstClockTime frame, bool reverse);
  // After a GAP event: the next frame comes, if it comes at all, by more than the time of some lost
  // frames after the newest.
  bool is_long(GstEvent* gap, GstClockTime frame, bool reverse) const;

 private:
  GstClockTime newest_ = GST_CLOCK_TIME_NONE;
};

}  // namespace qdmd
