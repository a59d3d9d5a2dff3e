// SPDX-License-Identifier: LGPL-2.1-or-later
// What qdmdbackground and qdmdseparate do alike around their frames: properties, signals, start,
// events, latency.
#pragma once

#include "gst/gstqdmdstate.h"

// A pad's formats, of 8 bits and of more, and its caps: who has a choice and no preference gets 8.
#define QDMD_FORMATS_OF_8_BITS                                                              \
  "RGBx, BGRx, xRGB, xBGR, RGBA, BGRA, ARGB, ABGR, RGB, BGR, GBR, I420, NV12, YV12, NV21, " \
  "Y42B, NV16, YUY2, UYVY, Y444, AYUV, A420, GRAY8"
#define QDMD_DEEP_FORMATS                                                                  \
  "I420_10LE, I422_10LE, Y444_10LE, P010_10LE, I420_12LE, I422_12LE, Y444_12LE, P012_LE, " \
  "Y444_16LE, P016_LE, GRAY16_LE, RGBA64_LE, ARGB64"
#define QDMD_FORMATS "{ " QDMD_FORMATS_OF_8_BITS ", " QDMD_DEEP_FORMATS " }"
#define QDMD_CAPS                                       \
  GST_VIDEO_CAPS_MAKE("{ " QDMD_FORMATS_OF_8_BITS " }") \
  "; " GST_VIDEO_CAPS_MAKE("{ " QDMD_DEEP_FORMATS " }")

namespace qdmd {

// In class_init; the class's instances have a State.
void install_properties_and_signals(GObjectClass* klass, WhichSettings which);

// From READY to PAUSED. False: an error was posted. close() is what ends it.
bool start(State& state);
// Other caps come, of this video, or of none (null): frames that wait have those before, and are
// sent.
void before_caps(State& state, const GstVideoInfo* info);
// The video that comes has these caps. With the stream lock. The engine begins anew, unless they
// say more of the same video. False: an error was posted.
bool begin_video(State& state, const GstVideoInfo& info, GstCaps* caps);
// Posts why caps that are no video to GStreamer are refused. Its frames have 2 GB at most.
void tell_of_caps(GstElement* self, GstCaps* caps);
// An event is about to be forwarded, from the streaming thread: what it ends is sent or dropped
// first. Caps are the element's own affair.
void before_event(State& state, GstEvent* event);
// A LATENCY query of a source pad.
bool answer_latency(State& state, GstPad* sink, GstQuery* query);
// Metadata about the picture's geometry stays true: size and orientation do not change here.
bool keeps_meta(const GstMetaInfo* info);

}  // namespace qdmd
