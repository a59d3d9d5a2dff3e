// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/analytics.h"

#include <gst/analytics/analytics.h>

#include <algorithm>
#include <cmath>

#include "gst/pointers.h"

namespace qdmd {
namespace {

gint rounded(double length) { return gint(std::lround(length)); }

void add_thing(GstAnalyticsRelationMeta* meta, const Object& thing) {
  static const GQuark kType = g_quark_from_static_string("foreground");
  const ObjectBox& box = thing.box;
  GstAnalyticsODMtd detection;
  // How sure it is: how much of the box is foreground.
  const auto share = gfloat(std::min(1.0, thing.area / std::max(1.0, box.area())));
  if (!gst_analytics_relation_meta_add_od_mtd(meta, kType, rounded(box.x), rounded(box.y),
                                              rounded(box.width), rounded(box.height), share,
                                              &detection))
    return;
  if (thing.id == 0) return;
  GstAnalyticsTrackingMtd tracking;
  if (!gst_analytics_relation_meta_add_tracking_mtd(meta, guint64(thing.id),
                                                    GstClockTime(thing.first_time), &tracking))
    return;
  gst_analytics_relation_meta_set_relation(meta, GST_ANALYTICS_REL_TYPE_RELATE_TO, detection.id,
                                           tracking.id);
}

#if GST_CHECK_VERSION(1, 26, 0)
void add_mask(GstAnalyticsRelationMeta* meta, const AnalysedFrame& frame) {
  const auto width = static_cast<gsize>(frame.width), height = static_cast<gsize>(frame.height);
  BufferPtr mask(gst_buffer_new_memdup(frame.mask, width * height));
  if (!mask) return;
  gsize offsets[GST_VIDEO_MAX_PLANES] = {};
  gint strides[GST_VIDEO_MAX_PLANES] = {frame.width};
  gst_buffer_add_video_meta_full(mask.get(), GST_VIDEO_FRAME_FLAG_NONE, GST_VIDEO_FORMAT_GRAY8,
                                 guint(width), guint(height), 1, offsets, strides);
  guint regions[] = {0, 255};
  GstAnalyticsSegmentationMtd segmentation;
  gst_analytics_relation_meta_add_segmentation_mtd(
      meta, mask.release(), GST_SEGMENTATION_TYPE_SEMANTIC, G_N_ELEMENTS(regions), regions, 0, 0,
      guint(width), guint(height), &segmentation);
}
#endif

}  // namespace

void attach_analytics(GstBuffer* buffer, const AnalysedFrame& frame) {
  GstAnalyticsRelationMeta* const meta = gst_buffer_add_analytics_relation_meta(buffer);
  if (!meta) return;
  for (const Object* thing : *frame.things) add_thing(meta, *thing);
#if GST_CHECK_VERSION(1, 26, 0)
  add_mask(meta, frame);
#endif
}

}  // namespace qdmd
