// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames of an element on their way through the engine, with their metadata.
#pragma once

#include "gst/gstqdmdstate.h"

namespace qdmd {

// Calls are from the streaming thread, with the stream lock and without the others. Errors are
// posted.

// True if frames of `info` are more of the video that the engine is configured for: samples of the
// same size and layout, that mean the same, and no setting waits for the next caps.
bool is_same_video(const State& state, const GstVideoInfo& info);
// Frames of that same video come with these caps from now on. No frame waits.
void follow_caps(State& state, const GstVideoInfo& info, GstCaps* caps);
// Makes the engine ready for frames of `info`. False: an error was posted.
bool configure(State& state, const Settings& settings, const GstVideoInfo& info, GstCaps* caps);
// Gives all memory back.
void close(State& state);
// Drops what waits and forgets the background.
void drop_frames(State& state);
// A GAP event after which no frame comes for longer than frames are missing.
bool is_long_gap(const State& state, GstEvent* event);
// Before a frame: what waits is sent where time jumps back or somebody asked for a reset.
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
// Pushes the pictures of all frames that are ready, and forwards what was held behind them.
GstFlowReturn send_ready(State& state);
// Solves for what is left and pushes it; the next frame begins a new window.
GstFlowReturn drain(State& state);
// Pushes what waits; the next frame goes on where it ended, as if it had come at once.
GstFlowReturn send_waiting(State& state);

}  // namespace qdmd
