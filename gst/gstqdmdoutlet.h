// SPDX-License-Identifier: LGPL-2.1-or-later
// A source pad of qdmdseparate: which pictures it sends, in which caps, out of which buffers.
#pragma once

#include <gst/video/video.h>

#include "core/foreground/picture.h"
#include "gst/pointers.h"
#include "gst/waitingframes.h"

G_BEGIN_DECLS

#define GST_TYPE_QDMD_OUTLET (gst_qdmd_outlet_get_type())
G_DECLARE_FINAL_TYPE(GstQdmdOutlet, gst_qdmd_outlet, GST, QDMD_OUTLET, GstPad)

G_END_DECLS

namespace qdmd {

// What the pad gives for video of `caps`, best first: the same format; others with the same
// colours, since only their layout differs; of a mask, GRAY8. The caller's.
GstCaps* caps_given(Output output, GstCaps* caps);
// The other way round: video of which the pad gives `caps`.
GstCaps* caps_needed(Output output, GstCaps* caps);

// Calls are from the streaming thread, with the sink pad's stream lock, unless they say otherwise.

// Any thread. Its pictures are of this kind.
GstPad* make_outlet(GstPadTemplate* pad_template, Output output);
// Any thread.
Output output_of(const GstQdmdOutlet* outlet);
// What was agreed with downstream is forgotten: the pad's next frame, or event, begins with the
// events of `sink`.
void reset_outlet(GstQdmdOutlet* outlet);
// Before an event or a frame: the sticky events that `sink` has and the pad lacks, but for those
// that wait behind frames; and caps, where downstream asked for others.
void sync_outlet(GstQdmdOutlet* outlet, GstPad* sink, const WaitingFrames& waiting);
// Tells downstream of video of these caps.
void negotiate_outlet(GstQdmdOutlet* outlet, GstCaps* input);
// `event` of the sink, with an identity of the pad's own.
void start_stream(GstQdmdOutlet* outlet, GstEvent* event);
// Downstream may take frames again, after it wanted no more.
void reopen_outlet(GstQdmdOutlet* outlet);
// How the frames that were pushed fared.
void note_flow(GstQdmdOutlet* outlet, GstFlowReturn flow);
// A buffer for a frame, with the metadata of `shell`. NOT_LINKED, EOS: nobody wants one.
GstFlowReturn take_buffer(GstQdmdOutlet* outlet, GstBuffer* shell, BufferPtr* buffer);
// The format of the buffers.
const GstVideoInfo* info_of(const GstQdmdOutlet* outlet);

}  // namespace qdmd
