// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/streamtime.h"

#include <algorithm>
#include <utility>

namespace qdmd {
namespace {

// The most that frames are apart while a camera loses some.
constexpr GstClockTime kMostGap = GST_SECOND;
constexpr guint64 kMostGapFrames = 5;
// Time that goes back by so much is another time; by less, a clock was corrected.
constexpr GstClockTimeDiff kJump = GST_SECOND;

bool is_gap(GstClockTimeDiff step, GstClockTime frame) {
  return step > 0 && GstClockTime(step) > frame + std::max(kMostGap, kMostGapFrames * frame);
}

}  // namespace

StreamTime::Step StreamTime::step_to(GstClockTime timestamp, GstClockTime frame, bool reverse) {
  const GstClockTime before = std::exchange(newest_, timestamp);
  if (!GST_CLOCK_TIME_IS_VALID(before) || !GST_CLOCK_TIME_IS_VALID(timestamp)) return Step::onwards;
  const GstClockTimeDiff step =
      reverse ? GST_CLOCK_DIFF(timestamp, before) : GST_CLOCK_DIFF(before, timestamp);
  if (step <= -kJump) return Step::jump;
  return GST_CLOCK_TIME_IS_VALID(frame) && is_gap(step, frame) ? Step::gap : Step::onwards;
}

bool StreamTime::is_long(GstEvent* gap, GstClockTime frame, bool reverse) const {
  GstClockTime start = 0, duration = 0;
  gst_event_parse_gap(gap, &start, &duration);
  if (!GST_CLOCK_TIME_IS_VALID(newest_) || !GST_CLOCK_TIME_IS_VALID(duration)) return true;
  const GstClockTimeDiff step =
      reverse ? GST_CLOCK_DIFF(start, newest_) : GST_CLOCK_DIFF(newest_, start + duration);
  return is_gap(step, GST_CLOCK_TIME_IS_VALID(frame) ? frame : 0);
}

}  // namespace qdmd
