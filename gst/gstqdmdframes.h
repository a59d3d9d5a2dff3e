// Frames of qdmdbackground on their way through the engine, with their metadata.
#pragma once

#include "gst/gstqdmdstate.h"

namespace qdmd {

// Calls are from the streaming thread, with the stream lock and without the others. Errors are
// posted.

// Makes the engine ready for frames of `info`. False: an error was posted.
bool configure(GstQdmdBackground* self, const Settings& settings, const GstVideoInfo& info,
               GstCaps* caps);
// Gives all memory back.
void close(GstQdmdBackground* self);
// Drops what waits and forgets the background.
void drop_frames(GstQdmdBackground* self);
// Before a frame: what waits is sent where time breaks or somebody asked for a reset.
GstFlowReturn prepare_for(GstQdmdBackground* self, GstBuffer* input);
// Takes a frame of the negotiated caps.
GstFlowReturn take_frame(GstQdmdBackground* self, BufferPtr buffer);
// The next ready frame as a buffer from the output pool, or null with OK where none is ready.
GstFlowReturn next_output(GstQdmdBackground* self, GstBuffer** out);
// Solves for what is left and pushes it; the next frame begins a new window.
GstFlowReturn drain(GstQdmdBackground* self);

}  // namespace qdmd
