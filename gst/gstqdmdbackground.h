// SPDX-License-Identifier: LGPL-2.1-or-later
#pragma once

#include <gst/video/gstvideofilter.h>

G_BEGIN_DECLS

#define GST_TYPE_QDMD_BACKGROUND (gst_qdmd_background_get_type())
G_DECLARE_FINAL_TYPE(GstQdmdBackground, gst_qdmd_background, GST, QDMD_BACKGROUND, GstVideoFilter)

GST_ELEMENT_REGISTER_DECLARE(qdmdbackground);

G_END_DECLS
