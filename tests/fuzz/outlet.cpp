// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/fuzz/outlet.h"

#include "tests/core/allocator.h"
#include "tests/fuzz/expect.h"

namespace qdmd::fuzz {
namespace allocator = qdmd::test::allocator;

void Outlet::connect(GstPad* source, const gint64* pushed) {
  source_ = source;
  pushed_ = pushed;
  // Without a template it would take the caps that it has, and no others.
  GstCaps* any = gst_caps_new_any();
  GstPadTemplate* takes_any = gst_pad_template_new("down", GST_PAD_SINK, GST_PAD_ALWAYS, any);
  gst_caps_unref(any);
  sink_ = gst_pad_new_from_template(takes_any, "down");
  gst_object_unref(takes_any);
  gst_object_ref_sink(sink_);
  gst_pad_set_element_private(sink_, this);
  gst_pad_set_chain_function(sink_, take);
  gst_pad_set_event_function(sink_, hear);
  gst_pad_set_query_function(sink_, answer);
  gst_pad_set_active(sink_, TRUE);
  // It fails where upstream has nothing that downstream takes.
  gst_pad_link(source, sink_);
}

void Outlet::disconnect() {
  if (!source_) return;
  gst_pad_set_active(sink_, FALSE);
  gst_pad_unlink(source_, sink_);
  GstPadTemplate* its = gst_pad_get_pad_template(source_);
  GstElement* element = gst_pad_get_parent_element(source_);
  if (GST_PAD_TEMPLATE_PRESENCE(its) == GST_PAD_REQUEST)
    gst_element_release_request_pad(element, source_);
  gst_object_unref(element);
  gst_object_unref(its);
  gst_clear_object(&source_);
  gst_clear_object(&sink_);
  gst_clear_caps(&taken_);
  flow_ = GST_FLOW_OK;
  has_caps_ = pool_ = false;
  last_ = -1;
}

void Outlet::take_only(GstCaps* caps, bool pool) {
  gst_clear_caps(&taken_);
  taken_ = caps;
  pool_ = pool;
  push_event(gst_event_new_reconfigure());
}

Outlet* Outlet::of(GstPad* pad) { return static_cast<Outlet*>(gst_pad_get_element_private(pad)); }

GstFlowReturn Outlet::take(GstPad* pad, GstObject*, GstBuffer* buffer) {
  const allocator::Unseen unseen;
  Outlet* self = of(pad);
  QDMD_DEMAND(self->has_caps_);
  GstVideoFrame frame;
  QDMD_DEMAND(gst_video_frame_map(&frame, &self->info_, buffer, GST_MAP_READ));
  // All of it was written, and is there.
  unsigned sum = 0;
  for (guint plane = 0; plane < GST_VIDEO_FRAME_N_PLANES(&frame); ++plane)
    sum += *static_cast<const guint8*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, plane));
  QDMD_DEMAND(sum <= 4 * 255);
  gst_video_frame_unmap(&frame);
  const auto number = gint64(GST_BUFFER_OFFSET(buffer));
  QDMD_DEMAND(number > self->last_ && number < *self->pushed_);
  self->last_ = number;
  gst_buffer_unref(buffer);
  return self->flow_;
}

gboolean Outlet::hear(GstPad* pad, GstObject*, GstEvent* event) {
  const allocator::Unseen unseen;
  Outlet* self = of(pad);
  if (GST_EVENT_TYPE(event) == GST_EVENT_CAPS) {
    GstCaps* caps = nullptr;
    gst_event_parse_caps(event, &caps);
    QDMD_DEMAND(gst_video_info_from_caps(&self->info_, caps));
    self->has_caps_ = true;
  }
  gst_event_unref(event);
  return TRUE;
}

gboolean Outlet::answer(GstPad* pad, GstObject* parent, GstQuery* query) {
  const Outlet* self = of(pad);
  if (GST_QUERY_TYPE(query) == GST_QUERY_CAPS && self->taken_) {
    GstCaps* filter = nullptr;
    gst_query_parse_caps(query, &filter);
    GstCaps* caps = filter ? gst_caps_intersect(filter, self->taken_) : gst_caps_ref(self->taken_);
    gst_query_set_caps_result(query, caps);
    gst_caps_unref(caps);
    return TRUE;
  }
  if (GST_QUERY_TYPE(query) == GST_QUERY_ALLOCATION && self->pool_) {
    GstCaps* caps = nullptr;
    gst_query_parse_allocation(query, &caps, nullptr);
    GstVideoInfo info;
    if (!caps || !gst_video_info_from_caps(&info, caps)) return FALSE;
    GstBufferPool* pool = gst_video_buffer_pool_new();
    gst_query_add_allocation_pool(query, pool, guint(info.size), 0, 0);
    gst_query_add_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
    gst_object_unref(pool);
    return TRUE;
  }
  return gst_pad_query_default(pad, parent, query);
}

}  // namespace qdmd::fuzz
