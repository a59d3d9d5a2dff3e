// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/latency.h"

#include <algorithm>
#include <utility>

namespace qdmd {
namespace {

// The first intervals after which their mean is looked at; then after twice as many, and so on.
constexpr guint64 kFirstLook = 8;
// What sinks have in hand for what elements take (GstBaseSink's processing-deadline).
constexpr GstClockTime kInHand = 20 * GST_MSECOND;
// Latencies are added along a pipeline, and must not overflow.
constexpr GstClockTime kMost = GST_CLOCK_TIME_NONE / 16;
constexpr GstClockTime kMostSpan = GST_CLOCK_TIME_NONE / 2;

}  // namespace

bool Latency::configure(guint64 frames, gint rate_n, gint rate_d) {
  const bool known = rate_n > 0 && rate_d > 0;
  const GstClockTime before = promised_;
  frames_ = frames;
  promised_ = frames_time_ =
      std::min(kMost, gst_util_uint64_scale(frames * GST_SECOND, known ? guint64(rate_d) : 1,
                                            known ? guint64(rate_n) : kAssumedRate));
  restart();
  return promised_ != before;
}

double Latency::rate(gint rate_n, gint rate_d) const {
  if (intervals_ >= kFirstLook) return double(intervals_) * double(GST_SECOND) / double(span_);
  return rate_n > 0 && rate_d > 0 ? double(rate_n) / double(rate_d) : double(kAssumedRate);
}

bool Latency::promise(GstClockTime latency) {
  latency = std::min(latency, kMost);
  if (frames_ == 0 || latency <= promised_) return false;
  promised_ = latency;
  return true;
}

bool Latency::frame_in(GstClockTime timestamp) {
  if (!GST_CLOCK_TIME_IS_VALID(timestamp)) return false;
  const bool pause = std::exchange(pause_, false), paused = std::exchange(paused_, pause);
  const GstClockTime before = std::exchange(newest_, timestamp);
  if (!GST_CLOCK_TIME_IS_VALID(before) || (pause && !paused)) {
    first_ = timestamp;
    return false;
  }
  if (timestamp <= before) {
    first_ = std::min(first_, timestamp);
    return false;
  }
  ++intervals_;
  span_ = std::min(kMostSpan, span_ + std::min(kMostSpan, timestamp - before));
  if (intervals_ < kFirstLook || (intervals_ & (intervals_ - 1)) != 0) return false;
  const GstClockTime needed = std::min(kMost, gst_util_uint64_scale(span_, frames_, intervals_));
  // Timestamps are rounded, and cameras' frames come a bit early or late.
  frames_time_ = std::max(frames_time_, needed);
  return needed > promised_ + promised_ / 16 && promise(needed + span_ / intervals_);
}

bool Latency::held_up(GstClockTime held) {
  held = std::min(held, kMost);
  return frames_time_ + held > promised_ + kInHand && promise(frames_time_ + held + held / 4);
}

bool Latency::frame_out(GstClockTime timestamp, GstClockTime held) {
  if (frames_ == 0 || !GST_CLOCK_TIME_IS_VALID(timestamp) || !GST_CLOCK_TIME_IS_VALID(newest_) ||
      timestamp > newest_ || timestamp < first_)
    return false;
  const GstClockTime waited = std::min(kMost, newest_ - timestamp);
  if (waited > promised_ + kInHand / 2) return promise(waited + waited / 16 + held);
  return waited + held > promised_ + kInHand && promise(waited + held + held / 4);
}

// What sinks wait for beyond the frames that wait here holds upstream up: a camera that can keep
// less of it than that loses frames all the time, and not only while a solve takes too long.
void Latency::add_to(bool live, GstClockTime* min, GstClockTime* max) const {
  const GstClockTime frames = std::min(frames_time_, promised_);
  GstClockTime more = promised_ - frames;
  if (GST_CLOCK_TIME_IS_VALID(*max)) {
    if (live) more = std::min(more, *max > *min ? *max - *min : 0);
    *max += frames;
  }
  *min += frames + more;
}

}  // namespace qdmd
