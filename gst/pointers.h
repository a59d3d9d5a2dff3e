// SPDX-License-Identifier: LGPL-2.1-or-later
// GStreamer's objects with an owner.
#pragma once

#include <gst/gst.h>

#include <memory>

namespace qdmd {

struct UnrefBuffer {
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
};
using BufferPtr = std::unique_ptr<GstBuffer, UnrefBuffer>;

struct UnrefSample {
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
};
using SamplePtr = std::unique_ptr<GstSample, UnrefSample>;

struct UnrefCaps {
  void operator()(GstCaps* caps) const { gst_caps_unref(caps); }
};
using CapsPtr = std::unique_ptr<GstCaps, UnrefCaps>;

struct UnrefClock {
  void operator()(GstClock* clock) const { gst_object_unref(clock); }
};
using ClockPtr = std::unique_ptr<GstClock, UnrefClock>;

struct FreeChars {
  void operator()(gchar* chars) const { g_free(chars); }
};
using CharsPtr = std::unique_ptr<gchar, FreeChars>;

struct UnrefEvent {
  void operator()(GstEvent* event) const { gst_event_unref(event); }
};
using EventPtr = std::unique_ptr<GstEvent, UnrefEvent>;

}  // namespace qdmd
