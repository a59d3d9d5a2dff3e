// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/gstqdmdelement.h"

#include "gst/gstqdmdareas.h"
#include "gst/gstqdmdenums.h"
#include "gst/gstqdmdframes.h"
#include "gst/gstqdmdlearnt.h"

GST_DEBUG_CATEGORY_EXTERN(qdmd_background_debug);
#define GST_CAT_DEFAULT qdmd_background_debug

namespace qdmd {
namespace {

// Behind those of the settings.
constexpr guint kLoadLocationProperty = kMostSettings, kStatsProperty = kMostSettings + 1,
                kBackgroundProperty = kMostSettings + 2;

GQuark state_quark() {
  static const GQuark quark = g_quark_from_static_string("qdmd-state");
  return quark;
}

State& state_of(gpointer element) {
  return *static_cast<State*>(g_object_get_qdata(G_OBJECT(element), state_quark()));
}

// ---- Properties and signals ---------------------------------------------------------------------

void set_load_location(GObject* object, const GValue* value) {
  State& state = state_of(object);
  // The old one ends after the lock.
  CharsPtr location(g_value_dup_string(value));
  GST_OBJECT_LOCK(object);
  state.load_location.swap(location);
  const bool changed = g_strcmp0(state.load_location.get(), location.get()) != 0;
  const bool running = GST_STATE(object) > GST_STATE_READY;
  GST_OBJECT_UNLOCK(object);
  if (changed && running)
    GST_ELEMENT_WARNING(object, LIBRARY, SETTINGS,
                        ("load-location takes effect when the element starts again from READY: "
                         "use the signal `load` now."),
                        (nullptr));
}

// Without locks.
void warn_of_rectangles(GstElement* self, guint left_out) {
  if (left_out > 0)
    GST_ELEMENT_WARNING(
        self, LIBRARY, SETTINGS,
        ("ignore leaves out %u %s. Each must have four whole numbers, x, "
         "y, width and height, the last two above 0. There can be %u at most.",
         left_out, left_out == 1 ? "rectangle" : "rectangles", guint(IgnoredAreas::kMost)),
        (nullptr));
}

void set_property(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  State& state = state_of(object);
  if (id == kLoadLocationProperty) {
    set_load_location(object, value);
    return;
  }
  GValue before = G_VALUE_INIT;
  g_value_init(&before, G_PARAM_SPEC_VALUE_TYPE(spec));
  GST_OBJECT_LOCK(object);
  get_setting(state.settings, id, &before);
  const bool known = set_setting(&state.settings, id, value);
  const bool running = GST_STATE(object) > GST_STATE_READY;
  const guint left_out = state.settings.ignored_left_out;
  const bool changed = known && g_param_values_cmp(spec, &before, value) != 0;
  const bool waits = changed && (spec->flags & GST_PARAM_MUTABLE_READY);
  state.configure_asked |= waits;
  GST_OBJECT_UNLOCK(object);
  g_value_unset(&before);
  if (!known) G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  // Before it starts, it may be in no pipeline that hears it.
  if (GST_IS_PARAM_SPEC_ARRAY_LIST(spec) && running)
    warn_of_rectangles(GST_ELEMENT(object), left_out);
  if (waits && running)
    GST_ELEMENT_WARNING(object, LIBRARY, SETTINGS,
                        ("%s takes effect with the next caps, or when the element starts again "
                         "from READY: until then nothing changes.",
                         spec->name),
                        (nullptr));
}

void get_property(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  State& state = state_of(object);
  GST_OBJECT_LOCK(object);
  bool known = get_setting(state.settings, id, value);
  if (id == kStatsProperty) {
    g_value_take_boxed(value, make_stats(state.report, state.counters));
    known = true;
  }
  if (id == kLoadLocationProperty) {
    g_value_set_string(value, state.load_location.get());
    known = true;
  }
  GST_OBJECT_UNLOCK(object);
  if (id == kBackgroundProperty) {
    const std::lock_guard lock(state.engine_lock);
    g_value_take_boxed(value, state.background.get(state.engine));
    known = true;
  }
  if (!known) G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void reset(GstElement* self) {
  GST_OBJECT_LOCK(self);
  state_of(self).reset_asked = true;
  GST_OBJECT_UNLOCK(self);
}

gboolean save_learnt_to(GstElement* self, const gchar* file) {
  return save_learnt(state_of(self), file);
}

gboolean load_learnt_of(GstElement* self, const gchar* file) {
  return load_learnt(state_of(self), file);
}

}  // namespace

void install_properties_and_signals(GObjectClass* klass, WhichSettings which) {
  klass->set_property = set_property;
  klass->get_property = get_property;
  install_settings(klass, which);
  g_object_class_install_property(
      klass, kLoadLocationProperty,
      g_param_spec_string(
          "load-location", "Load location",
          "File of the signal `save` whose background the element starts with: it "
          "is read each time that the element starts (null: none)",
          nullptr,
          GParamFlags(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY)));
  g_object_class_install_property(
      klass, kStatsProperty,
      g_param_spec_boxed(
          "stats", "Statistics",
          "Counters, and facts about the newest solve. What it found: rank, lambda (real and "
          "imaginary part), omega in rad/frame, residual, condition, foreground-ratio (0 to 1). "
          "How sure it is: rounding-bound and sensitivity in levels, and the solver and estimator "
          "that gave the result. What it took: gram-time and solve-time in seconds. What it was "
          "given: sample-step, iterations, solve-period (one of so many windows or hops is "
          "solved). time-per-frame (ms) is as learnt",
          GST_TYPE_STRUCTURE, GParamFlags(G_PARAM_READABLE | G_PARAM_STATIC_STRINGS)));
  g_object_class_install_property(
      klass, kBackgroundProperty,
      g_param_spec_boxed(
          "background", "Background",
          "The newest background picture, in the output's caps, with the time of the "
          "frames that came out with its solve; null before the first solve. It is "
          "made when you read it, and reading waits for a solve that is running",
          GST_TYPE_SAMPLE, GParamFlags(G_PARAM_READABLE | G_PARAM_STATIC_STRINGS)));
  /**
   * GstQdmdBackground::reset:
   *
   * Forgets the background. What waits in a batch is sent first; learning begins anew with the next
   * frame, in any state and from any thread.
   */
  g_signal_new_class_handler("reset", G_TYPE_FROM_CLASS(klass),
                             GSignalFlags(G_SIGNAL_RUN_LAST | G_SIGNAL_ACTION), G_CALLBACK(reset),
                             nullptr, nullptr, nullptr, G_TYPE_NONE, 0);
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
  g_signal_new_class_handler(
      "save", G_TYPE_FROM_CLASS(klass), GSignalFlags(G_SIGNAL_RUN_LAST | G_SIGNAL_ACTION),
      G_CALLBACK(save_learnt_to), nullptr, nullptr, nullptr, G_TYPE_BOOLEAN, 1, G_TYPE_STRING);
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
  g_signal_new_class_handler(
      "load", G_TYPE_FROM_CLASS(klass), GSignalFlags(G_SIGNAL_RUN_LAST | G_SIGNAL_ACTION),
      G_CALLBACK(load_learnt_of), nullptr, nullptr, nullptr, G_TYPE_BOOLEAN, 1, G_TYPE_STRING);
  for (GType type :
       {gst_qdmd_background_output_get_type(), gst_qdmd_background_mode_get_type(),
        gst_qdmd_background_method_get_type(), gst_qdmd_background_amplitude_get_type(),
        gst_qdmd_background_solver_get_type(), gst_qdmd_background_shadows_get_type(),
        gst_qdmd_background_stabilize_get_type(), gst_qdmd_background_estimator_get_type()})
    gst_type_mark_as_plugin_api(type, GstPluginAPIFlags(0));
}

// ---- Life ---------------------------------------------------------------------------------------

State::State(GstElement* its, const GstSegment* its_segment) : element(its), segment(its_segment) {
  g_object_set_qdata(G_OBJECT(element), state_quark(), this);
}

bool start(State& state) {
  GstElement* const self = state.element;
  GST_OBJECT_LOCK(self);
  state.counters = {};
  state.report = SolveReport();
  const guint left_out = state.settings.ignored_left_out;
  GST_OBJECT_UNLOCK(self);
  warn_of_rectangles(self, left_out);
  state.objects.begin_numbers();
  {
    const std::lock_guard lock(state.engine_lock);
    state.background.forget();
  }
  return read_load_location(state);
}

bool begin_video(State& state, const GstVideoInfo& info, GstCaps* caps) {
  GstElement* const self = state.element;
  if (GST_VIDEO_INFO_IS_INTERLACED(&info)) {
    GST_ELEMENT_ERROR(self, STREAM, FORMAT,
                      ("Interlaced video has two pictures in a frame: put deinterlace before "
                       "%s.",
                       GST_OBJECT_NAME(gst_element_get_factory(self))),
                      (nullptr));
    return false;
  }
  const bool same = is_same_video(state, info);
  GST_OBJECT_LOCK(self);
  const Settings settings = state.settings;
  if (!same) state.configure_asked = false;
  GST_OBJECT_UNLOCK(self);
  if (same)
    follow_caps(state, info, caps);
  else if (!configure(state, settings, info, caps))
    return false;

  GST_OBJECT_LOCK(self);
  const bool changed =
      state.latency.configure(guint64(state.engine.plan().layout().delay),
                              GST_VIDEO_INFO_FPS_N(&info), GST_VIDEO_INFO_FPS_D(&info));
  const GstClockTime latency = state.latency.promised();
  GST_OBJECT_UNLOCK(self);
  GST_INFO_OBJECT(self, "windows of %d frames, latency %" GST_TIME_FORMAT,
                  settings.engine.window_size, GST_TIME_ARGS(latency));
  if (changed) gst_element_post_message(self, gst_message_new_latency(GST_OBJECT(self)));
  return true;
}

void tell_of_caps(GstElement* self, GstCaps* caps) {
  gint width = 0, height = 0;
  const GstStructure* video = gst_caps_get_structure(caps, 0);
  gst_structure_get_int(video, "width", &width);
  gst_structure_get_int(video, "height", &height);
  if (width < 1 || height < 1 || !gst_structure_has_field(video, "format")) {
    GST_ELEMENT_ERROR(self, STREAM, FORMAT,
                      ("Caps without a format, a width and a height are no video: put a capsfilter "
                       "that has them before %s.",
                       GST_OBJECT_NAME(gst_element_get_factory(self))),
                      ("%" GST_PTR_FORMAT, static_cast<gpointer>(caps)));
    return;
  }
  GST_ELEMENT_ERROR(self, RESOURCE, NO_SPACE_LEFT,
                    ("A frame of %dx%d is more than GStreamer can hold, whatever window-size and "
                     "max-memory allow: scale the video down.",
                     width, height),
                    ("%" GST_PTR_FORMAT, static_cast<gpointer>(caps)));
}

// ---- Events, queries, metadata ------------------------------------------------------------------

void before_caps(State& state, const GstVideoInfo* info) {
  if (info && is_same_video(state, *info))
    send_waiting(state);
  else
    drain(state);
}

void before_event(State& state, GstEvent* event) {
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_STREAM_START:
      // Another stream, another scene.
      drain(state);
      drop_frames(state);
      break;
    case GST_EVENT_SEGMENT:
      drain(state);
      state.objects.cut_off(state.element);
      break;
    case GST_EVENT_SEGMENT_DONE:
    // Nothing more may come for long.
    case GST_EVENT_STREAM_GROUP_DONE:
    case GST_EVENT_EOS:
      // The flow of these frames is not the event's: EOS goes on whatever they met.
      drain(state);
      if (GST_EVENT_TYPE(event) == GST_EVENT_EOS) state.objects.cut_off(state.element);
      break;
    case GST_EVENT_GAP:
      // Frames do not wait for those that do not come.
      if (is_long_gap(state, event)) send_waiting(state);
      break;
    case GST_EVENT_FLUSH_STOP:
      drop_frames(state);
      break;
    default:
      break;
  }
}

bool answer_latency(State& state, GstPad* sink, GstQuery* query) {
  if (!gst_pad_peer_query(sink, query)) return false;
  gboolean live = FALSE;
  GstClockTime min = 0, max = GST_CLOCK_TIME_NONE;
  gst_query_parse_latency(query, &live, &min, &max);
  GST_OBJECT_LOCK(state.element);
  state.latency.add_to(live, &min, &max);
  GST_OBJECT_UNLOCK(state.element);
  gst_query_set_latency(query, live, min, max);
  return true;
}

bool keeps_meta(const GstMetaInfo* info) {
  static const char* const kept[] = {GST_META_TAG_VIDEO_STR, GST_META_TAG_VIDEO_ORIENTATION_STR,
                                     GST_META_TAG_VIDEO_SIZE_STR, GST_META_TAG_VIDEO_COLORSPACE_STR,
                                     nullptr};
  const gchar* const* tags = gst_meta_api_type_get_tags(info->api);
  for (; tags && *tags; ++tags)
    if (!g_strv_contains(kept, *tags)) return false;
  return true;
}

}  // namespace qdmd
