// SPDX-License-Identifier: LGPL-2.1-or-later
#pragma once

#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_QDMD_SEPARATE (gst_qdmd_separate_get_type())
G_DECLARE_FINAL_TYPE(GstQdmdSeparate, gst_qdmd_separate, GST, QDMD_SEPARATE, GstElement)

GST_ELEMENT_REGISTER_DECLARE(qdmdseparate);

G_END_DECLS
