// SPDX-License-Identifier: LGPL-2.1-or-later
// The things of a frame as GStreamer's own analytics metadata, which elements of others read
// (GStreamer 1.24 and later; built only where its library is found).
#pragma once

#include <gst/video/video.h>

#include <vector>

#include "core/objects/object.h"

namespace qdmd {

// What attach_analytics() says of a frame.
struct AnalysedFrame {
  const std::vector<const Object*>* things;
  const guint8* mask;  // 255 where foreground, else 0, width * height samples
  int width, height;   // pixels
};

// Adds a GstAnalyticsRelationMeta: for each thing a detection of the type `foreground`, and,
// related to it, the tracking of its number; with GStreamer 1.26, the mask as a semantic
// segmentation, too (region 255 is the foreground). What cannot be added is left out.
void attach_analytics(GstBuffer* buffer, const AnalysedFrame& frame);

}  // namespace qdmd
