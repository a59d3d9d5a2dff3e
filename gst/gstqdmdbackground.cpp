/**
 * SECTION:element-qdmdbackground
 * @title: qdmdbackground
 * @short_description: Separates background and foreground of video from a camera that stands still
 *
 * qdmdbackground collects a window of frames, computes its quaternion dynamic mode decomposition
 * (Q-DMD: each pixel is one pure quaternion R i + G j + B k, so the colour channels stay coupled),
 * takes the mode that does not change in time for the background, and sends every frame on as the
 * background, the foreground, a mask or a cut-out. Each output buffer has its own frame's
 * timestamps, flags and metadata; as many buffers come out as went in.
 *
 * In #GstQdmdBackground:mode `batch` a frame waits for the last one of its window and for what a
 * solve takes; then one leaves for each that comes. The element reports that latency. Keep audio in
 * step with a queue of more max-size-time. Its window takes 3 x window-size x width x height bytes.
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
#include <new>
#include <utility>

#include "gst/gstqdmdareas.h"
#include "gst/gstqdmdenums.h"
#include "gst/gstqdmdframes.h"
#include "gst/gstqdmdlearnt.h"

GST_DEBUG_CATEGORY(qdmd_background_debug);
#define GST_CAT_DEFAULT qdmd_background_debug

namespace {

using qdmd::Settings;

constexpr guint kLoadLocationProperty = qdmd::kFirstFreeProperty,
                kStatsProperty = qdmd::kFirstFreeProperty + 1,
                kBackgroundProperty = qdmd::kFirstFreeProperty + 2;

#define QDMD_FORMATS                                                                          \
  "{ RGBx, BGRx, xRGB, xBGR, RGBA, BGRA, ARGB, ABGR, RGB, BGR, GBR, I420, NV12, YV12, NV21, " \
  "Y42B, "                                                                                    \
  "NV16, YUY2, UYVY, Y444, AYUV, A420, GRAY8 }"

}  // namespace

#define gst_qdmd_background_parent_class parent_class
G_DEFINE_TYPE_WITH_CODE(GstQdmdBackground, gst_qdmd_background, GST_TYPE_VIDEO_FILTER,
                        GST_DEBUG_CATEGORY_INIT(qdmd_background_debug, "qdmdbackground", 0,
                                                "Q-DMD background separation"))
GST_ELEMENT_REGISTER_DEFINE(qdmdbackground, "qdmdbackground", GST_RANK_NONE,
                            GST_TYPE_QDMD_BACKGROUND)

// ---- Properties ---------------------------------------------------------------------------------

static void gst_qdmd_background_set_load_location(GObject* object, const GValue* value) {
  qdmd::State* state = GST_QDMD_BACKGROUND(object)->state;
  // The old one ends after the lock.
  qdmd::CharsPtr location(g_value_dup_string(value));
  GST_OBJECT_LOCK(object);
  state->load_location.swap(location);
  const bool changed = g_strcmp0(state->load_location.get(), location.get()) != 0;
  const bool running = GST_STATE(object) > GST_STATE_READY;
  GST_OBJECT_UNLOCK(object);
  if (changed && running)
    GST_ELEMENT_WARNING(object, LIBRARY, SETTINGS,
                        ("load-location takes effect when the element starts again from READY: "
                         "use the signal `load` now."),
                        (nullptr));
}

// Without locks.
static void warn_of_rectangles(GObject* object, const GValue* value, GParamSpec* spec) {
  qdmd::IgnoredAreas areas;
  const guint left_out = qdmd::add_areas_of(value, &areas);
  if (left_out > 0)
    GST_ELEMENT_WARNING(
        object, LIBRARY, SETTINGS,
        ("%s leaves out %u rectangles: each has four whole numbers, x, y, width and "
         "height, the last two above 0, and there are at most %u.",
         spec->name, left_out, guint(qdmd::IgnoredAreas::kMost)),
        (nullptr));
}

static void gst_qdmd_background_set_property(GObject* object, guint id, const GValue* value,
                                             GParamSpec* spec) {
  qdmd::State* state = GST_QDMD_BACKGROUND(object)->state;
  if (id == kLoadLocationProperty) {
    gst_qdmd_background_set_load_location(object, value);
    return;
  }
  GValue before = G_VALUE_INIT;
  g_value_init(&before, G_PARAM_SPEC_VALUE_TYPE(spec));
  GST_OBJECT_LOCK(object);
  qdmd::get_setting(state->settings, id, &before);
  const bool known = qdmd::set_setting(&state->settings, id, value);
  const bool running = GST_STATE(object) > GST_STATE_READY;
  GST_OBJECT_UNLOCK(object);
  const bool changed = known && g_param_values_cmp(spec, &before, value) != 0;
  g_value_unset(&before);
  if (!known) G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  if (GST_IS_PARAM_SPEC_ARRAY_LIST(spec)) warn_of_rectangles(object, value, spec);
  if (changed && running && (spec->flags & GST_PARAM_MUTABLE_READY))
    GST_ELEMENT_WARNING(object, LIBRARY, SETTINGS,
                        ("%s takes effect with the next caps, or when the element starts again "
                         "from READY: until then nothing changes.",
                         spec->name),
                        (nullptr));
}

static void gst_qdmd_background_get_property(GObject* object, guint id, GValue* value,
                                             GParamSpec* spec) {
  qdmd::State* state = GST_QDMD_BACKGROUND(object)->state;
  GST_OBJECT_LOCK(object);
  bool known = qdmd::get_setting(state->settings, id, value);
  if (id == kStatsProperty) {
    g_value_take_boxed(value, qdmd::make_stats(state->report, state->counters));
    known = true;
  }
  if (id == kLoadLocationProperty) {
    g_value_set_string(value, state->load_location.get());
    known = true;
  }
  GST_OBJECT_UNLOCK(object);
  if (id == kBackgroundProperty) {
    const std::lock_guard lock(state->engine_lock);
    g_value_take_boxed(value, state->background.get(state->engine));
    known = true;
  }
  if (!known) G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

// ---- Frames ----------------------------------------------------------------------------------

static GstFlowReturn gst_qdmd_background_submit_input_buffer(GstBaseTransform* trans,
                                                             gboolean is_discont,
                                                             GstBuffer* input) {
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(trans);
  GstFlowReturn flow = qdmd::prepare_for(self, input);
  if (flow != GST_FLOW_OK) {
    gst_buffer_unref(input);
    return flow;
  }
  // The parent renegotiates where that is due and leaves the buffer in queued_buf.
  flow = GST_BASE_TRANSFORM_CLASS(parent_class)->submit_input_buffer(trans, is_discont, input);
  if (flow != GST_FLOW_OK || !trans->queued_buf) return flow;
  return qdmd::take_frame(self, qdmd::BufferPtr(std::exchange(trans->queued_buf, nullptr)));
}

static GstFlowReturn gst_qdmd_background_generate_output(GstBaseTransform* trans, GstBuffer** out) {
  return qdmd::next_output(GST_QDMD_BACKGROUND(trans), out);
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
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(filter);
  qdmd::State* state = self->state;

  GST_OBJECT_LOCK(self);
  const Settings settings = state->settings;
  GST_OBJECT_UNLOCK(self);

  if (GST_VIDEO_INFO_IS_INTERLACED(in)) {
    GST_ELEMENT_ERROR(self, STREAM, FORMAT,
                      ("Interlaced video has two pictures in a frame: put deinterlace before "
                       "qdmdbackground."),
                      (nullptr));
    return FALSE;
  }
  if (!qdmd::configure(self, settings, *in, caps)) return FALSE;

  GST_OBJECT_LOCK(self);
  const bool changed = state->latency.configure(guint64(state->engine.delay()),
                                                GST_VIDEO_INFO_FPS_N(in), GST_VIDEO_INFO_FPS_D(in));
  const GstClockTime latency = state->latency.promised();
  GST_OBJECT_UNLOCK(self);
  GST_INFO_OBJECT(self, "windows of %d frames, latency %" GST_TIME_FORMAT,
                  settings.engine.window_size, GST_TIME_ARGS(latency));
  if (changed)
    gst_element_post_message(GST_ELEMENT(self), gst_message_new_latency(GST_OBJECT(self)));
  return TRUE;
}

static gboolean gst_qdmd_background_sink_event(GstBaseTransform* trans, GstEvent* event) {
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(trans);
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_CAPS: {
      GstCaps* caps = nullptr;
      GstVideoInfo info;
      gst_event_parse_caps(event, &caps);
      // Frames that wait belong to the old caps; equal caps change nothing.
      if (!GST_VIDEO_FILTER(self)->negotiated || !gst_video_info_from_caps(&info, caps) ||
          !gst_video_info_is_equal(&info, &GST_VIDEO_FILTER(self)->in_info))
        qdmd::drain(self);
      break;
    }
    case GST_EVENT_STREAM_START:
      // Another stream, another scene.
      qdmd::drain(self);
      qdmd::drop_frames(self);
      break;
    case GST_EVENT_SEGMENT:
    case GST_EVENT_SEGMENT_DONE:
    case GST_EVENT_GAP:
    case GST_EVENT_EOS:
      // The flow of these frames is not the event's: EOS goes on whatever they met.
      qdmd::drain(self);
      break;
    case GST_EVENT_FLUSH_STOP:
      qdmd::drop_frames(self);
      break;
    default:
      break;
  }
  return GST_BASE_TRANSFORM_CLASS(parent_class)->sink_event(trans, event);
}

static gboolean gst_qdmd_background_query(GstBaseTransform* trans, GstPadDirection direction,
                                          GstQuery* query) {
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(trans);
  if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY || direction != GST_PAD_SRC)
    return GST_BASE_TRANSFORM_CLASS(parent_class)->query(trans, direction, query);

  if (!gst_pad_peer_query(GST_BASE_TRANSFORM_SINK_PAD(trans), query)) return FALSE;
  gboolean live = FALSE;
  GstClockTime min = 0, max = GST_CLOCK_TIME_NONE;
  gst_query_parse_latency(query, &live, &min, &max);
  GST_OBJECT_LOCK(self);
  self->state->latency.add_to(live, &min, &max);
  GST_OBJECT_UNLOCK(self);
  gst_query_set_latency(query, live, min, max);
  return TRUE;
}

// Metadata about the picture's geometry stays true: size and orientation do not change here.
static gboolean gst_qdmd_background_transform_meta(GstBaseTransform*, GstBuffer*, GstMeta* meta,
                                                   GstBuffer*) {
  static const char* const kept[] = {GST_META_TAG_VIDEO_STR, GST_META_TAG_VIDEO_ORIENTATION_STR,
                                     GST_META_TAG_VIDEO_SIZE_STR, GST_META_TAG_VIDEO_COLORSPACE_STR,
                                     nullptr};
  const gchar* const* tags = gst_meta_api_type_get_tags(meta->info->api);
  for (; tags && *tags; ++tags)
    if (!g_strv_contains(kept, *tags)) return FALSE;
  return TRUE;
}

static gboolean gst_qdmd_background_start(GstBaseTransform* trans) {
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(trans);
  qdmd::State* state = self->state;
  GST_OBJECT_LOCK(self);
  state->counters = {};
  state->report = qdmd::SolveReport();
  GST_OBJECT_UNLOCK(self);
  {
    const std::lock_guard lock(state->engine_lock);
    state->background.forget();
  }
  return qdmd::read_load_location(self);
}

static gboolean gst_qdmd_background_stop(GstBaseTransform* trans) {
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(trans);
  qdmd::close(self);
  return TRUE;
}

// ---- Class --------------------------------------------------------------------------------------

static void gst_qdmd_background_finalize(GObject* object) {
  std::destroy_at(GST_QDMD_BACKGROUND(object)->state);
  G_OBJECT_CLASS(parent_class)->finalize(object);
}

static void gst_qdmd_background_init(GstQdmdBackground* self) {
  // Nothing of it takes memory yet.
  self->state = new (self->room_of_state) qdmd::State();
  // A decomposition in time needs every frame.
  gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(self), FALSE);
}

static void gst_qdmd_background_reset(GstQdmdBackground* self) {
  GST_OBJECT_LOCK(self);
  self->state->reset_asked = true;
  GST_OBJECT_UNLOCK(self);
}

static gboolean gst_qdmd_background_save(GstQdmdBackground* self, const gchar* file) {
  return qdmd::save_learnt(self, file);
}

static gboolean gst_qdmd_background_load(GstQdmdBackground* self, const gchar* file) {
  return qdmd::load_learnt(self, file);
}

static void gst_qdmd_background_class_init(GstQdmdBackgroundClass* klass) {
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  GstBaseTransformClass* trans_class = GST_BASE_TRANSFORM_CLASS(klass);
  GstVideoFilterClass* filter_class = GST_VIDEO_FILTER_CLASS(klass);

  object_class->set_property = gst_qdmd_background_set_property;
  object_class->get_property = gst_qdmd_background_get_property;
  object_class->finalize = gst_qdmd_background_finalize;
  qdmd::install_settings(object_class);
  g_object_class_install_property(
      object_class, kLoadLocationProperty,
      g_param_spec_string(
          "load-location", "Load location",
          "File of the signal `save` whose background the element starts with: it "
          "is read each time that the element starts (null: none)",
          nullptr,
          GParamFlags(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY)));
  g_object_class_install_property(
      object_class, kStatsProperty,
      g_param_spec_boxed("stats", "Statistics",
                         "Counters, and facts about the newest solve: rank, lambda (real and "
                         "imaginary part), omega in rad/frame, residual, condition, "
                         "rounding-bound and sensitivity in levels, solver (that gave the result), "
                         "foreground-ratio (0 to 1), gram-time and solve-time in seconds, and "
                         "what it was given: sample-step, iterations, solve-period (of so many "
                         "windows or hops one is solved); time-per-frame (ms), as learnt",
                         GST_TYPE_STRUCTURE,
                         GParamFlags(G_PARAM_READABLE | G_PARAM_STATIC_STRINGS)));
  g_object_class_install_property(
      object_class, kBackgroundProperty,
      g_param_spec_boxed("background", "Background",
                         "The newest background picture in the output's caps, with the time of the "
                         "frames that came out with its solve; null before the first solve. It is "
                         "made when you ask, which waits for a solve that is under way",
                         GST_TYPE_SAMPLE, GParamFlags(G_PARAM_READABLE | G_PARAM_STATIC_STRINGS)));
  /**
   * GstQdmdBackground::reset:
   *
   * Forgets the background. What waits in a batch is sent first; learning begins anew with the next
   * frame, in any state and from any thread.
   */
  g_signal_new_class_handler(
      "reset", G_TYPE_FROM_CLASS(klass), GSignalFlags(G_SIGNAL_RUN_LAST | G_SIGNAL_ACTION),
      G_CALLBACK(gst_qdmd_background_reset), nullptr, nullptr, nullptr, G_TYPE_NONE, 0);
  /**
   * GstQdmdBackground::save:
   * @file: name of the file, in the encoding of file names
   *
   * Writes what was learnt of the background into a file, in place of what it held: the picture of
   * the property `background`, noise, and of `method=robust` what the next window is told. Waits
   * for a solve that is under way. Any thread, while the element is PAUSED or PLAYING.
   *
   * Returns: %TRUE if it is written. Else the file is as it was, and a warning was posted.
   */
  g_signal_new_class_handler("save", G_TYPE_FROM_CLASS(klass),
                             GSignalFlags(G_SIGNAL_RUN_LAST | G_SIGNAL_ACTION),
                             G_CALLBACK(gst_qdmd_background_save), nullptr, nullptr, nullptr,
                             G_TYPE_BOOLEAN, 1, G_TYPE_STRING);
  /**
   * GstQdmdBackground::load:
   * @file: name of the file, in the encoding of file names
   *
   * Goes on with what was learnt and saved, of video of the same size and colour family (RGB, YUV
   * or grey), from any thread; before caps are known it waits for them. No frame is lost. In
   * #GstQdmdBackground:mode `live` the loaded background is held from the next frame on until there
   * is a new model. In `batch` the windows that end from now on are told of it (`method=robust`),
   * and it is the background at once where there is none yet or no frame waits. The signal `reset`,
   * a flush and a new stream forget it.
   *
   * Returns: %TRUE if it is loaded, or waits for caps. Else nothing has changed, and a warning was
   * posted.
   */
  g_signal_new_class_handler("load", G_TYPE_FROM_CLASS(klass),
                             GSignalFlags(G_SIGNAL_RUN_LAST | G_SIGNAL_ACTION),
                             G_CALLBACK(gst_qdmd_background_load), nullptr, nullptr, nullptr,
                             G_TYPE_BOOLEAN, 1, G_TYPE_STRING);

  gst_element_class_set_static_metadata(
      element_class, "Q-DMD background separator", "Filter/Effect/Video",
      "Separates background and foreground of video from a static camera by quaternion dynamic "
      "mode decomposition",
      "The gst-qdmd authors <gst-qdmd@localhost>");
  for (const auto& [name, direction] :
       {std::pair{"sink", GST_PAD_SINK}, std::pair{"src", GST_PAD_SRC}}) {
    GstCaps* caps = gst_caps_from_string(GST_VIDEO_CAPS_MAKE(QDMD_FORMATS));
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

  for (GType type :
       {gst_qdmd_background_output_get_type(), gst_qdmd_background_mode_get_type(),
        gst_qdmd_background_method_get_type(), gst_qdmd_background_amplitude_get_type(),
        gst_qdmd_background_solver_get_type(), gst_qdmd_background_shadows_get_type(),
        gst_qdmd_background_stabilize_get_type(), gst_qdmd_background_estimator_get_type()})
    gst_type_mark_as_plugin_api(type, GstPluginAPIFlags(0));
}
