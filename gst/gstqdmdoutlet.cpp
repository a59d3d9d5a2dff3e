// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/gstqdmdoutlet.h"

#include <algorithm>
#include <cstring>

#include "gst/gstqdmdelement.h"

GST_DEBUG_CATEGORY_EXTERN(qdmd_separate_debug);
#define GST_CAT_DEFAULT qdmd_separate_debug

struct _GstQdmdOutlet {
  GstPad parent;
  qdmd::Output output;
  // Protected by the sink pad's stream lock.
  gboolean fresh;       // it has seen none of the sink's events
  gboolean ended;       // downstream wants no more
  gboolean negotiated;  // `info` is what downstream takes
  GstVideoInfo info;
  GstBufferPool* pool;  // null: to be asked for
};

G_DEFINE_TYPE(GstQdmdOutlet, gst_qdmd_outlet, GST_TYPE_PAD)

namespace qdmd {
namespace {

void drop_pool(GstQdmdOutlet* outlet) {
  if (!outlet->pool) return;
  gst_buffer_pool_set_active(outlet->pool, FALSE);
  gst_clear_object(&outlet->pool);
}

// ---- Caps ---------------------------------------------------------------------------------------

// Formats between which only the layout of the samples differs: a number for each kind of colours
// and bits of a sample; 0: no video.
constexpr size_t kFamilies = 3 * 16 + 1;
size_t family_of(const gchar* name) {
  const GstVideoFormat format = gst_video_format_from_string(name);
  if (format == GST_VIDEO_FORMAT_UNKNOWN) return 0;
  const GstVideoFormatInfo* info = gst_video_format_get_info(format);
  const size_t depth = GST_VIDEO_FORMAT_INFO_DEPTH(info, 0);
  if (depth < 1 || depth > 16) return 0;
  if (GST_VIDEO_FORMAT_INFO_IS_YUV(info)) return depth;
  if (GST_VIDEO_FORMAT_INFO_IS_RGB(info)) return 16 + depth;
  return GST_VIDEO_FORMAT_INFO_IS_GRAY(info) ? 32 + depth : 0;
}

// The element's formats.
const GValue* all_formats() {
  static const GValue* const formats = [] {
    auto* list = new GValue(G_VALUE_INIT);
    g_value_init(list, GST_TYPE_LIST);
    gst_value_deserialize(list, QDMD_FORMATS);
    return list;
  }();
  return formats;
}

template <typename See>
void each_format(const GValue* formats, See see) {
  if (!formats) return;
  if (G_VALUE_HOLDS_STRING(formats)) {
    see(g_value_get_string(formats));
  } else if (GST_VALUE_HOLDS_LIST(formats)) {
    for (guint i = 0; i < gst_value_list_get_size(formats); ++i)
      see(g_value_get_string(gst_value_list_get_value(formats, i)));
  }
}

bool has_format(const GstStructure* video, const char* name) {
  const GValue* formats = gst_structure_get_value(video, "format");
  bool has = !formats;
  each_format(formats, [&](const gchar* format) { has |= std::strcmp(format, name) == 0; });
  return has;
}

// This video in the element's formats that `keep` says; nothing where there are none.
template <typename Keep>
void append_formats(GstCaps* caps, const GstStructure* video, Keep keep) {
  GValue list = G_VALUE_INIT;
  g_value_init(&list, GST_TYPE_LIST);
  each_format(all_formats(), [&](const gchar* format) {
    if (!keep(format)) return;
    GValue name = G_VALUE_INIT;
    g_value_init(&name, G_TYPE_STRING);
    g_value_set_string(&name, format);
    gst_value_list_append_and_take_value(&list, &name);
  });
  if (gst_value_list_get_size(&list) > 0) {
    GstStructure* other = gst_structure_copy(video);
    // Where chroma lies is the format's affair.
    gst_structure_remove_field(other, "chroma-site");
    gst_structure_set_value(other, "format", &list);
    gst_caps_append_structure(caps, other);
  }
  g_value_unset(&list);
}

// Other layouts of the same colours.
void append_family(GstCaps* caps, const GstStructure* video) {
  bool wanted[kFamilies] = {};
  const GValue* formats = gst_structure_get_value(video, "format");
  each_format(formats, [&](const gchar* format) { wanted[family_of(format)] = true; });
  append_formats(caps, video,
                 [&](const gchar* format) { return !formats || wanted[family_of(format)]; });
}

void append_without_colours(GstCaps* caps, const GstStructure* video, const char* only) {
  GstStructure* plain = gst_structure_copy(video);
  gst_structure_remove_field(plain, "colorimetry");
  append_formats(caps, plain,
                 [only](const gchar* format) { return !only || std::strcmp(format, only) == 0; });
  gst_structure_free(plain);
}

}  // namespace

GstCaps* caps_given(Output output, GstCaps* caps) {
  GstCaps* given = gst_caps_copy(caps);
  for (guint i = 0; i < gst_caps_get_size(caps); ++i)
    append_family(given, gst_caps_get_structure(caps, i));
  for (guint i = 0; output == Output::mask && i < gst_caps_get_size(caps); ++i)
    append_without_colours(given, gst_caps_get_structure(caps, i), "GRAY8");
  return given;
}

GstCaps* caps_needed(Output output, GstCaps* caps) {
  GstCaps* needed = gst_caps_new_empty();
  const guint count = gst_caps_get_size(caps);
  const auto any = [&](guint i) {
    return output == Output::mask && has_format(gst_caps_get_structure(caps, i), "GRAY8");
  };
  // The format that needs no other comes first; but grey masks are no reason for grey video.
  for (guint i = 0; i < count; ++i)
    if (!any(i))
      gst_caps_append_structure(needed, gst_structure_copy(gst_caps_get_structure(caps, i)));
  for (guint i = 0; i < count; ++i) {
    const GstStructure* video = gst_caps_get_structure(caps, i);
    if (any(i))
      append_without_colours(needed, video, nullptr);
    else
      append_family(needed, video);
  }
  return needed;
}

// ---- A stream of its own ------------------------------------------------------------------------

GstPad* make_outlet(GstPadTemplate* pad_template, Output output) {
  auto* outlet = GST_QDMD_OUTLET(
      g_object_new(GST_TYPE_QDMD_OUTLET, "name", GST_PAD_TEMPLATE_NAME_TEMPLATE(pad_template),
                   "direction", GST_PAD_SRC, "template", pad_template, nullptr));
  outlet->output = output;
  return GST_PAD(outlet);
}

Output output_of(const GstQdmdOutlet* outlet) { return outlet->output; }

const GstVideoInfo* info_of(const GstQdmdOutlet* outlet) { return &outlet->info; }

void reset_outlet(GstQdmdOutlet* outlet) {
  drop_pool(outlet);
  outlet->fresh = TRUE;
  outlet->ended = outlet->negotiated = FALSE;
}

void reopen_outlet(GstQdmdOutlet* outlet) { outlet->ended = FALSE; }

void note_flow(GstQdmdOutlet* outlet, GstFlowReturn flow) { outlet->ended = flow == GST_FLOW_EOS; }

void start_stream(GstQdmdOutlet* outlet, GstEvent* event) {
  GstElement* element = gst_pad_get_parent_element(GST_PAD(outlet));
  if (!element) return;
  gchar* id = gst_pad_create_stream_id(GST_PAD(outlet), element, GST_PAD_NAME(outlet));
  GstEvent* own = gst_event_new_stream_start(id);
  g_free(id);
  gst_object_unref(element);
  GstStreamFlags flags = GST_STREAM_FLAG_NONE;
  gst_event_parse_stream_flags(event, &flags);
  gst_event_set_stream_flags(own, flags);
  guint group = 0;
  if (gst_event_parse_group_id(event, &group)) gst_event_set_group_id(own, group);
  gst_event_set_seqnum(own, gst_event_get_seqnum(event));
  gst_pad_push_event(GST_PAD(outlet), own);
}

void negotiate_outlet(GstQdmdOutlet* outlet, GstCaps* input) {
  GstPad* pad = GST_PAD(outlet);
  drop_pool(outlet);
  outlet->negotiated = FALSE;
  const CapsPtr given(caps_given(outlet->output, input));
  CapsPtr agreed(gst_pad_peer_query_caps(pad, given.get()));
  // Some answer in an order of their own.
  agreed.reset(gst_caps_intersect_full(given.get(), agreed.get(), GST_CAPS_INTERSECT_FIRST));
  if (gst_caps_is_empty(agreed.get())) {
    GST_WARNING_OBJECT(pad, "downstream takes none of %" GST_PTR_FORMAT,
                       static_cast<gpointer>(given.get()));
    gst_pad_mark_reconfigure(pad);
    return;
  }
  agreed.reset(gst_caps_fixate(gst_caps_truncate(agreed.release())));
  outlet->negotiated = gst_video_info_from_caps(&outlet->info, agreed.get());
  const CapsPtr before(gst_pad_get_current_caps(pad));
  if (before && gst_caps_is_equal(before.get(), agreed.get())) return;
  gst_pad_push_event(pad, gst_event_new_caps(agreed.get()));
  // A pad that is flushing does not keep them.
  const CapsPtr after(gst_pad_get_current_caps(pad));
  if (after && gst_caps_is_equal(after.get(), agreed.get())) return;
  outlet->negotiated = FALSE;
  gst_pad_mark_reconfigure(pad);
}

struct Following {
  GstQdmdOutlet* outlet;
  const WaitingFrames& waiting;
};

static gboolean follow_event(GstPad*, GstEvent** event, gpointer data) {
  const auto& [outlet, waiting] = *static_cast<const Following*>(data);
  if (waiting.holds(*event)) return TRUE;
  switch (GST_EVENT_TYPE(*event)) {
    case GST_EVENT_STREAM_START:
      start_stream(outlet, *event);
      break;
    case GST_EVENT_CAPS: {
      GstCaps* caps = nullptr;
      gst_event_parse_caps(*event, &caps);
      negotiate_outlet(outlet, caps);
      break;
    }
    case GST_EVENT_EOS:
      break;
    default:
      gst_pad_push_event(GST_PAD(outlet), gst_event_ref(*event));
      break;
  }
  return TRUE;
}

void sync_outlet(GstQdmdOutlet* outlet, GstPad* sink, const WaitingFrames& waiting) {
  // It would keep nothing.
  if (GST_PAD_IS_FLUSHING(GST_PAD(outlet))) return;
  const bool asked = gst_pad_check_reconfigure(GST_PAD(outlet));
  if (std::exchange(outlet->fresh, FALSE)) {
    Following following = {outlet, waiting};
    gst_pad_sticky_events_foreach(sink, follow_event, &following);
  } else if (asked) {
    outlet->ended = FALSE;
    const CapsPtr caps(gst_pad_get_current_caps(sink));
    if (caps) negotiate_outlet(outlet, caps.get());
  }
}

// ---- Buffers ------------------------------------------------------------------------------------

namespace {

// Downstream's pool where it has one, else one of our own.
GstBufferPool* ask_for_pool(GstQdmdOutlet* outlet) {
  const CapsPtr caps(gst_pad_get_current_caps(GST_PAD(outlet)));
  if (!caps) return nullptr;
  GstQuery* query = gst_query_new_allocation(caps.get(), TRUE);
  // Without an answer nothing is in it.
  gst_pad_peer_query(GST_PAD(outlet), query);
  GstAllocator* allocator = nullptr;
  GstAllocationParams params;
  gst_allocation_params_init(&params);
  if (gst_query_get_n_allocation_params(query) > 0)
    gst_query_parse_nth_allocation_param(query, 0, &allocator, &params);
  GstBufferPool* pool = nullptr;
  guint size = 0, least = 0, most = 0;
  if (gst_query_get_n_allocation_pools(query) > 0)
    gst_query_parse_nth_allocation_pool(query, 0, &pool, &size, &least, &most);
  size = std::max(size, guint(GST_VIDEO_INFO_SIZE(&outlet->info)));
  const bool meta = gst_query_find_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
  gst_query_unref(query);
  for (bool own : {!pool, true}) {
    if (own) {
      gst_clear_object(&pool);
      pool = gst_video_buffer_pool_new();
      least = most = 0;
    }
    GstStructure* config = gst_buffer_pool_get_config(pool);
    gst_buffer_pool_config_set_params(config, caps.get(), size, least, most);
    gst_buffer_pool_config_set_allocator(config, allocator, &params);
    if (meta && gst_buffer_pool_has_option(pool, GST_BUFFER_POOL_OPTION_VIDEO_META))
      gst_buffer_pool_config_add_option(config, GST_BUFFER_POOL_OPTION_VIDEO_META);
    if (gst_buffer_pool_set_config(pool, config) && gst_buffer_pool_set_active(pool, TRUE)) break;
    if (own) gst_clear_object(&pool);
  }
  if (allocator) gst_object_unref(allocator);
  return pool;
}

gboolean copy_meta(GstBuffer* from, GstMeta** meta, gpointer to) {
  const GstMetaInfo* info = (*meta)->info;
  GstMetaTransformCopy whole = {FALSE, 0, gsize(-1)};
  if (info->transform_func && keeps_meta(info))
    info->transform_func(static_cast<GstBuffer*>(to), *meta, from, _gst_meta_transform_copy,
                         &whole);
  return TRUE;
}

}  // namespace

GstFlowReturn take_buffer(GstQdmdOutlet* outlet, GstBuffer* shell, BufferPtr* buffer) {
  if (!gst_pad_is_linked(GST_PAD(outlet))) return GST_FLOW_NOT_LINKED;
  if (outlet->ended) return GST_FLOW_EOS;
  if (!outlet->negotiated)
    return GST_PAD_IS_FLUSHING(GST_PAD(outlet)) ? GST_FLOW_FLUSHING : GST_FLOW_NOT_NEGOTIATED;
  if (!outlet->pool) outlet->pool = ask_for_pool(outlet);
  if (!outlet->pool) return GST_FLOW_NOT_NEGOTIATED;
  GstBuffer* made = nullptr;
  const GstFlowReturn flow = gst_buffer_pool_acquire_buffer(outlet->pool, &made, nullptr);
  if (flow != GST_FLOW_OK) return flow;
  gst_buffer_copy_into(made, shell,
                       GstBufferCopyFlags(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS), 0,
                       gsize(-1));
  gst_buffer_foreach_meta(shell, copy_meta, made);
  buffer->reset(made);
  return GST_FLOW_OK;
}

}  // namespace qdmd

// ---- Class --------------------------------------------------------------------------------------

static void gst_qdmd_outlet_finalize(GObject* object) {
  qdmd::drop_pool(GST_QDMD_OUTLET(object));
  G_OBJECT_CLASS(gst_qdmd_outlet_parent_class)->finalize(object);
}

static void gst_qdmd_outlet_init(GstQdmdOutlet* outlet) { outlet->fresh = TRUE; }

static void gst_qdmd_outlet_class_init(GstQdmdOutletClass* klass) {
  G_OBJECT_CLASS(klass)->finalize = gst_qdmd_outlet_finalize;
}
