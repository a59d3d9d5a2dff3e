// SPDX-License-Identifier: LGPL-2.1-or-later
// Registers the scene source, in a plugin of its own: qdmdbackground does without its libraries.
#include <gst/gst.h>

#include "gst/gstqdmdscenesrc.h"

static gboolean plugin_init(GstPlugin* plugin) {
  return GST_ELEMENT_REGISTER(qdmdscenesrc, plugin);
}

GST_PLUGIN_DEFINE(GST_VERSION_MAJOR, GST_VERSION_MINOR, qdmdscene,
                  "Simulated scenes with known backgrounds", plugin_init, QDMD_VERSION, "LGPL",
                  "gst-qdmd", "gst-qdmd")
