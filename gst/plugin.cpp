// SPDX-License-Identifier: LGPL-2.1-or-later
// Registers the plugin's elements.
#include <gst/gst.h>

#include "gst/gstqdmdbackground.h"
#include "gst/gstqdmdseparate.h"

static gboolean plugin_init(GstPlugin* plugin) {
  return GST_ELEMENT_REGISTER(qdmdbackground, plugin) && GST_ELEMENT_REGISTER(qdmdseparate, plugin);
}

GST_PLUGIN_DEFINE(GST_VERSION_MAJOR, GST_VERSION_MINOR, qdmd,
                  "Background separation by quaternion dynamic mode decomposition", plugin_init,
                  QDMD_VERSION, "LGPL", "gst-qdmd", "gst-qdmd")
