// Frames of an element on their way through the engine, with their metadata.
#pragma once

#include "gst/gstqdmdstate.h"

namespace qdmd {

// Calls are from the streaming thread, with the stream lock and without the others. Errors are
// posted.

// Makes the engine ready for frames of `info`. False: an error was posted.
bool configure(State& state, const Settings& settings, const GstVideoInfo& info, GstCaps* caps);
// Gives all memory back.
void close(State& state);
// Drops what waits and forgets the background.
void drop_frames(State& state);
// Before a frame: what waits is sent where time breaks or somebody asked for a reset.
GstFlowReturn prepare_for(State& state, GstBuffer* input);
// Takes a frame of the negotiated caps.
GstFlowReturn take_frame(State& state, BufferPtr buffer);
// Takes an event that is about to be forwarded, and keeps it behind the frames that wait. False: it
// is the caller's to forward now. Caps always are.
bool hold_event(State& state, GstEvent* event);
// Forwards events that were held behind frames which have left.
void send_events(State& state);
// Does that, and then makes the pictures that are wanted of the next ready frame, which has left by
// then; none with OK where none is ready.
GstFlowReturn next_pictures(State& state, OutputPictures* pictures);
// Solves for what is left and pushes it; the next frame begins a new window.
GstFlowReturn drain(State& state);

}  // namespace qdmd
