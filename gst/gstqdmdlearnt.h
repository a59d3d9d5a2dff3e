// The signals `save` and `load`, and the property `load-location`.
#pragma once

#include "gst/gstqdmdstate.h"

namespace qdmd {

// Calls are without locks. What goes wrong is posted, and changes nothing.

// The signals, from any thread.
bool save_learnt(GstElement* self, const gchar* file);
bool load_learnt(GstElement* self, const gchar* file);

// When the element starts. False: an error was posted.
bool read_load_location(GstElement* self);
// Gives what was loaded to the engine, once that is configured. From the streaming thread. False:
// an error was posted.
bool apply_loaded(GstElement* self);

}  // namespace qdmd
