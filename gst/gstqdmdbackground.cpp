// SPDX-License-Identifier: LGPL-2.1-or-later
/**
 * SECTION:element-qdmdbackground
 * @title: qdmdbackground
 * @short_description: Separates background and foreground of video from a camera that stands still
 *
 * qdmdbackground collects a window of frames, learns their background, and sends every frame on as
 * the background, the foreground, a mask or a cut-out. Each output buffer has its own frame's
 * timestamps, flags and metadata; as many buffers come out as went in.
 *
 * By default (#GstQdmdBackground:method `robust`) it finds what moves and takes it out first, so
 * that the background has no ghosts. The quaternion dynamic mode decomposition (Q-DMD) of what is
 * left gives the mode that does not change in time. Each pixel is one pure quaternion R i + G j +
 * B k, so the colour channels stay coupled. With `qdmd`, the paper's method, the decomposition is
 * of the frames as they come; `dmd` decomposes each channel by itself.
 *
 * In #GstQdmdBackground:mode `batch` a frame waits for the last one of its window and for what a
 * solve takes; then one leaves for each that comes. The element reports that latency. Keep audio in
 * step with a queue of more max-size-time.
 *
 * The window takes 3 bytes a pixel and frame, in 4:2:0 formats 1.5, and twice as many in formats of
 * more than 8 bits. The whole element takes about 1.6 times as many, and never more than
 * #GstQdmdBackground:max-memory.
 *
 * References: J. Han, K. I. Kou and J. Miao, "Quaternion-based dynamic mode decomposition for
 * background modeling in color videos" (Q-DMD); J. H. Tu et al., "On dynamic mode decomposition"
 * (exact DMD).
 *
 * ## Example launch lines
 * |[
 * gst-launch-1.0 videotestsrc pattern=ball num-buffers=200 ! qdmdbackground window-size=50 ! \
 *     videoconvert ! autovideosink
 * ]| The ball disappears.
 * |[
 * gst-launch-1.0 filesrc location=street.avi ! decodebin ! videoconvert ! \
 *     qdmdbackground output=mask ! videoconvert ! autovideosink
 * ]| White where something moves.
 *
 * Since: 0.1
 */
#include "gst/gstqdmdbackground.h"

#include <memory>
#include <utility>

#include "gst/gstqdmdelement.h"
#include "gst/gstqdmdframes.h"

GST_DEBUG_CATEGORY(qdmd_background_debug);
#define GST_CAT_DEFAULT qdmd_background_debug

namespace {

using qdmd::Output;

// One picture a frame, in the base class's buffers.
class BackgroundState : public qdmd::State {
 public:
  explicit BackgroundState(GstQdmdBackground* self)
      : State(GST_ELEMENT(self), &GST_BASE_TRANSFORM(self)->segment),
        trans_(GST_BASE_TRANSFORM(self)) {}

  bool wants_masks(const qdmd::Settings& its) const override {
    return its.output == Output::mask || its.output == Output::cutout;
  }
  bool wants_masks_alone(const qdmd::Settings& its) const override {
    return its.output == Output::mask;
  }
  GstFlowReturn make_pictures(GstBuffer* shell, const qdmd::Settings& its,
                              qdmd::OutputPictures* pictures) override {
    GstBuffer* made = nullptr;
    const GstFlowReturn flow =
        GST_BASE_TRANSFORM_GET_CLASS(trans_)->prepare_output_buffer(trans_, shell, &made);
    qdmd::BufferPtr buffer(made);
    if (flow == GST_FLOW_OK && buffer)
      pictures->add({its.output, &GST_VIDEO_FILTER(trans_)->out_info, std::move(buffer)});
    return flow;
  }
  GstFlowReturn send(qdmd::OutputPictures* pictures) override {
    GstFlowReturn flow = GST_FLOW_OK;
    for (qdmd::OutputPicture& picture : *pictures)
      flow = gst_pad_push(GST_BASE_TRANSFORM_SRC_PAD(trans_), picture.buffer.release());
    return flow;
  }
  void forward(qdmd::EventPtr event) override {
    gst_pad_push_event(GST_BASE_TRANSFORM_SRC_PAD(trans_), event.release());
  }
  void keep(qdmd::EventPtr event) override {
    gst_pad_store_sticky_event(GST_BASE_TRANSFORM_SRC_PAD(trans_), event.get());
  }

 private:
  GstBaseTransform* trans_;
};

}  // namespace

// What GLib aligns instances to.
static_assert(alignof(BackgroundState) <= 16);
struct _GstQdmdBackground {
  GstVideoFilter parent;
  // GLib makes the memory; init() and finalize() make and end the state in it.
  BackgroundState state;
};

#define gst_qdmd_background_parent_class parent_class
G_DEFINE_TYPE_WITH_CODE(GstQdmdBackground, gst_qdmd_background, GST_TYPE_VIDEO_FILTER,
                        GST_DEBUG_CATEGORY_INIT(qdmd_background_debug, "qdmdbackground", 0,
                                                "Q-DMD background separation"))
GST_ELEMENT_REGISTER_DEFINE(qdmdbackground, "qdmdbackground", GST_RANK_NONE,
                            GST_TYPE_QDMD_BACKGROUND)

static BackgroundState& state_of(GstBaseTransform* trans) {
  return GST_QDMD_BACKGROUND(trans)->state;
}

// ---- Frames ----------------------------------------------------------------------------------

static GstFlowReturn gst_qdmd_background_submit_input_buffer(GstBaseTransform* trans,
                                                             gboolean is_discont,
                                                             GstBuffer* input) {
  BackgroundState& state = state_of(trans);
  GstFlowReturn flow = qdmd::prepare_for(state, input);
  if (flow != GST_FLOW_OK) {
    gst_buffer_unref(input);
    return flow;
  }
  // The parent renegotiates where that is due and leaves the buffer in queued_buf.
  flow = GST_BASE_TRANSFORM_CLASS(parent_class)->submit_input_buffer(trans, is_discont, input);
  if (flow != GST_FLOW_OK || !trans->queued_buf) return flow;
  return qdmd::take_frame(state, qdmd::BufferPtr(std::exchange(trans->queued_buf, nullptr)));
}

static GstFlowReturn gst_qdmd_background_generate_output(GstBaseTransform* trans, GstBuffer** out) {
  // Of a buffer with the flag DISCONT the base class would mark the next one that it pushes, too,
  // which came earlier.
  *out = nullptr;
  return qdmd::send_ready(state_of(trans));
}

// GstVideoFilter works in place on elements without this function; frames never come here, they go
// through submit_input_buffer and generate_output.
static GstFlowReturn gst_qdmd_background_transform_frame(GstVideoFilter*, GstVideoFrame*,
                                                         GstVideoFrame*) {
  return GST_FLOW_NOT_SUPPORTED;
}

// ---- Negotiation, events, queries ---------------------------------------------------------------

static gboolean gst_qdmd_background_set_info(GstVideoFilter* filter, GstCaps* caps,
                                             GstVideoInfo* in, GstCaps*, GstVideoInfo*) {
  return qdmd::begin_video(state_of(GST_BASE_TRANSFORM(filter)), *in, caps);
}

static gboolean gst_qdmd_background_sink_event(GstBaseTransform* trans, GstEvent* event) {
  if (GST_EVENT_TYPE(event) == GST_EVENT_CAPS) {
    GstCaps* caps = nullptr;
    GstVideoInfo info;
    gst_event_parse_caps(event, &caps);
    const bool known = gst_video_info_from_caps(&info, caps);
    // Frames that wait belong to the old caps. The base class sets any others, even if the video is
    // the same.
    const qdmd::CapsPtr before(gst_pad_get_current_caps(GST_BASE_TRANSFORM_SINK_PAD(trans)));
    if (!before || !gst_caps_is_equal(before.get(), caps))
      qdmd::before_caps(state_of(trans), known ? &info : nullptr);
    if (!known) qdmd::tell_of_caps(GST_ELEMENT(trans), caps);
  }
  qdmd::before_event(state_of(trans), event);
  if (qdmd::hold_event(state_of(trans), event)) return TRUE;
  return GST_BASE_TRANSFORM_CLASS(parent_class)->sink_event(trans, event);
}

static gboolean gst_qdmd_background_query(GstBaseTransform* trans, GstPadDirection direction,
                                          GstQuery* query) {
  if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY || direction != GST_PAD_SRC)
    return GST_BASE_TRANSFORM_CLASS(parent_class)->query(trans, direction, query);
  return qdmd::answer_latency(state_of(trans), GST_BASE_TRANSFORM_SINK_PAD(trans), query);
}

static gboolean gst_qdmd_background_transform_meta(GstBaseTransform*, GstBuffer*, GstMeta* meta,
                                                   GstBuffer*) {
  return qdmd::keeps_meta(meta->info);
}

static gboolean gst_qdmd_background_start(GstBaseTransform* trans) {
  return qdmd::start(state_of(trans));
}

static gboolean gst_qdmd_background_stop(GstBaseTransform* trans) {
  qdmd::close(state_of(trans));
  return TRUE;
}

// ---- Class --------------------------------------------------------------------------------------

static void gst_qdmd_background_finalize(GObject* object) {
  std::destroy_at(&GST_QDMD_BACKGROUND(object)->state);
  G_OBJECT_CLASS(parent_class)->finalize(object);
}

static void gst_qdmd_background_init(GstQdmdBackground* self) {
  // Nothing of it takes memory yet.
  std::construct_at(&self->state, self);
  // A decomposition in time needs every frame.
  gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(self), FALSE);
}

static void gst_qdmd_background_class_init(GstQdmdBackgroundClass* klass) {
  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  GstBaseTransformClass* trans_class = GST_BASE_TRANSFORM_CLASS(klass);
  GstVideoFilterClass* filter_class = GST_VIDEO_FILTER_CLASS(klass);

  G_OBJECT_CLASS(klass)->finalize = gst_qdmd_background_finalize;
  qdmd::install_properties_and_signals(G_OBJECT_CLASS(klass), qdmd::WhichSettings::all);
  gst_element_class_set_static_metadata(
      element_class, "Q-DMD background separator", "Filter/Effect/Video",
      "Separates background and foreground of video from a static camera by quaternion dynamic "
      "mode decomposition",
      "The gst-qdmd authors <gst-qdmd@localhost>");
  for (const auto& [name, direction] :
       {std::pair{"sink", GST_PAD_SINK}, std::pair{"src", GST_PAD_SRC}}) {
    GstCaps* caps = gst_caps_from_string(QDMD_CAPS);
    gst_element_class_add_pad_template(element_class,
                                       gst_pad_template_new(name, direction, GST_PAD_ALWAYS, caps));
    gst_caps_unref(caps);
  }

  trans_class->start = GST_DEBUG_FUNCPTR(gst_qdmd_background_start);
  trans_class->stop = GST_DEBUG_FUNCPTR(gst_qdmd_background_stop);
  trans_class->submit_input_buffer = GST_DEBUG_FUNCPTR(gst_qdmd_background_submit_input_buffer);
  trans_class->generate_output = GST_DEBUG_FUNCPTR(gst_qdmd_background_generate_output);
  trans_class->sink_event = GST_DEBUG_FUNCPTR(gst_qdmd_background_sink_event);
  trans_class->query = GST_DEBUG_FUNCPTR(gst_qdmd_background_query);
  trans_class->transform_meta = GST_DEBUG_FUNCPTR(gst_qdmd_background_transform_meta);
  filter_class->set_info = GST_DEBUG_FUNCPTR(gst_qdmd_background_set_info);
  filter_class->transform_frame = GST_DEBUG_FUNCPTR(gst_qdmd_background_transform_frame);
}
