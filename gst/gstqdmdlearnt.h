// SPDX-License-Identifier: LGPL-2.1-or-later
// The signals `save` and `load`, and the property `load-location`.
#pragma once

#include "gst/gstqdmdstate.h"

namespace qdmd {

// Calls are without locks. What goes wrong is posted, and changes nothing.

// The signals, from any thread.
bool save_learnt(State& state, const gchar* file);
bool load_learnt(State& state, const gchar* file);

// When the element starts. False: an error was posted.
bool read_load_location(State& state);
// Gives what was loaded to the engine, once that is configured. From the streaming thread. False:
// an error was posted.
bool apply_loaded(State& state);

}  // namespace qdmd
