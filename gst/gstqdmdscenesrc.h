// SPDX-License-Identifier: LGPL-2.1-or-later
#pragma once

#include <gst/base/gstpushsrc.h>

G_BEGIN_DECLS

#define GST_TYPE_QDMD_SCENE_SRC (gst_qdmd_scene_src_get_type())
G_DECLARE_FINAL_TYPE(GstQdmdSceneSrc, gst_qdmd_scene_src, GST, QDMD_SCENE_SRC, GstPushSrc)

GST_ELEMENT_REGISTER_DECLARE(qdmdscenesrc);

G_END_DECLS
