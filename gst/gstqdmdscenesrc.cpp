// SPDX-License-Identifier: LGPL-2.1-or-later
/**
 * SECTION:element-qdmdscenesrc
 * @title: qdmdscenesrc
 * @short_description: Simulated scenes of a street, with their true background and mask
 *
 * qdmdscenesrc makes video of a street in which a person walks by, and whatever effects its
 * properties name: noise, a shaking camera, changing light, waving leaves, bags that are left. With
 * #GstQdmdSceneSrc:truth it sends what is true of the same frames instead. `background` is what the
 * camera would see without anybody, before weather, noise and compression. `mask` is what does not
 * belong to it, and `labels` also mark shadows and edges. Sources of one seed, one scene and one
 * frame rate are in step.
 *
 * A frame follows from its number, the seed and the scene alone: seeking to it gives what playing
 * up to it gives. Effects that are not named cost nothing.
 *
 * #GstQdmdSceneSrc:scene is a preset, or effects with values: `effect=value`, further parameters
 * after colons, effects joined by commas. A wrong name or value is an error that lists what is
 * allowed. docs/scenes.md shows each of them.
 *
 * ## Example launch lines
 * |[
 * gst-launch-1.0 qdmdscenesrc ! videoconvert ! autovideosink
 * ]| Persons cross a street.
 * |[
 * gst-launch-1.0 qdmdscenesrc scene="noise=3,jitter=1.5:frequency=2,shadow" seed=7 ! \
 *     qdmdbackground output=mask ! videoconvert ! autovideosink
 * ]| What qdmdbackground takes for foreground where the camera shakes.
 * |[
 * gst-launch-1.0 qdmdscenesrc scene=background-motion truth=background num-buffers=100 ! \
 *     video/x-raw,width=768,height=576,framerate=25/1 ! pngenc ! multifilesink location=%03d.png
 * ]| One hundred true backgrounds.
 *
 * Since: 0.1
 */
#include "gst/gstqdmdscenesrc.h"

#include <exception>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "core/scene/scene.h"
#include "gst/scenewriter.h"
#include "gst/sceneyuv.h"
#include "gst/videoview.h"

GST_DEBUG_CATEGORY_STATIC(qdmd_scene_src_debug);
#define GST_CAT_DEFAULT qdmd_scene_src_debug

namespace {

using qdmd::MappedVideoFrame;
using namespace qdmd::scene;

#define QDMD_FORMATS                                                                           \
  "{ RGBx, BGRx, xRGB, xBGR, RGBA, BGRA, ARGB, ABGR, RGB, BGR, I420, NV12, Y42B, YUY2, Y444, " \
  "I420_10LE, P010_10LE, GRAY8 }"

constexpr gint kWidth = 320, kHeight = 240, kRate = 25;

constexpr const char* kNoEnd =
    "Backwards needs an end: seek with a stop position, or give the scene a length.";

enum Truth { TRUTH_NONE, TRUTH_BACKGROUND, TRUTH_MASK, TRUTH_LABELS };

struct Settings {
  std::string scene = "default", effects;
  guint64 seed = 0;
  Truth truth = TRUTH_NONE;
  gboolean post_messages = FALSE;
};

struct Private {
  // Protected by the object lock.
  Settings settings;
  GstVideoInfo told_info;  // what queries are answered from; frame rate 0: not negotiated
  gint64 told_length = 0;
  GstClockTime told_stop = GST_CLOCK_TIME_NONE;  // of the last seek

  // Protected by the stream lock.
  Settings playing;
  std::vector<NamedEffect> effects;
  std::optional<Scene> scene;
  std::optional<qdmd::SceneYuv> yuv;  // where the format is not of R, G and B
  GstVideoInfo info;
  std::optional<GstSegment> pending;  // a seek that came before the caps
  gint64 index = 0;                   // of the next frame
  gint step = 1;                      // -1: backwards
  // Frame first_index of the present frame rate is at first_time.
  gint64 first_index = 0;
  GstClockTime first_time = 0;
};

}  // namespace

struct _GstQdmdSceneSrc {
  GstPushSrc parent;
  Private* priv;
};

#define gst_qdmd_scene_src_parent_class parent_class
G_DEFINE_TYPE_WITH_CODE(GstQdmdSceneSrc, gst_qdmd_scene_src, GST_TYPE_PUSH_SRC,
                        GST_DEBUG_CATEGORY_INIT(qdmd_scene_src_debug, "qdmdscenesrc", 0,
                                                "simulated scenes"))
GST_ELEMENT_REGISTER_DEFINE(qdmdscenesrc, "qdmdscenesrc", GST_RANK_NONE, GST_TYPE_QDMD_SCENE_SRC)

static GType gst_qdmd_scene_src_truth_get_type() {
  static const GEnumValue values[] = {
      {TRUTH_NONE, "The frames themselves", "none"},
      {TRUTH_BACKGROUND, "The true background of each frame, before weather, noise and compression",
       "background"},
      {TRUTH_MASK,
       "White where an object covers at least half of the pixel, else black; shadows "
       "are black",
       "mask"},
      {TRUTH_LABELS,
       "CDnet's grey levels: 0 background, 50 shadow or mirror image, 170 an object covers less "
       "than half of the pixel, 255 object",
       "labels"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdSceneSrcTruth", values);
  return type;
}

// ---- Properties ---------------------------------------------------------------------------------

enum { PROP_0, PROP_SCENE, PROP_EFFECTS, PROP_SEED, PROP_TRUTH, PROP_POST_MESSAGES, PROP_IS_LIVE };

static void gst_qdmd_scene_src_set_property(GObject* object, guint id, const GValue* value,
                                            GParamSpec* spec) {
  Settings& settings = GST_QDMD_SCENE_SRC(object)->priv->settings;
  const auto text = [&] {
    const gchar* given = g_value_get_string(value);
    return std::string(given ? given : "");
  };
  if (id == PROP_IS_LIVE) {
    gst_base_src_set_live(GST_BASE_SRC(object), g_value_get_boolean(value));
    return;
  }
  GST_OBJECT_LOCK(object);
  switch (id) {
    case PROP_SCENE:
      settings.scene = text();
      break;
    case PROP_EFFECTS:
      settings.effects = text();
      break;
    case PROP_SEED:
      settings.seed = g_value_get_uint64(value);
      break;
    case PROP_TRUTH:
      settings.truth = Truth(g_value_get_enum(value));
      break;
    case PROP_POST_MESSAGES:
      settings.post_messages = g_value_get_boolean(value);
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
      break;
  }
  GST_OBJECT_UNLOCK(object);
}

static void gst_qdmd_scene_src_get_property(GObject* object, guint id, GValue* value,
                                            GParamSpec* spec) {
  const Settings& settings = GST_QDMD_SCENE_SRC(object)->priv->settings;
  if (id == PROP_IS_LIVE) {
    g_value_set_boolean(value, gst_base_src_is_live(GST_BASE_SRC(object)));
    return;
  }
  GST_OBJECT_LOCK(object);
  switch (id) {
    case PROP_SCENE:
      g_value_set_string(value, settings.scene.c_str());
      break;
    case PROP_EFFECTS:
      g_value_set_string(value, settings.effects.c_str());
      break;
    case PROP_SEED:
      g_value_set_uint64(value, settings.seed);
      break;
    case PROP_TRUTH:
      g_value_set_enum(value, settings.truth);
      break;
    case PROP_POST_MESSAGES:
      g_value_set_boolean(value, settings.post_messages);
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
      break;
  }
  GST_OBJECT_UNLOCK(object);
}

// ---- Frames -------------------------------------------------------------------------------------

// Runs `action`; false where it threw, after an error that repeats its sentence.
template <typename Action>
static bool guarded(GstQdmdSceneSrc* self, Action action) {
  try {
    action();
    return true;
  } catch (const std::bad_alloc&) {
    GST_ELEMENT_ERROR(self, RESOURCE, NO_SPACE_LEFT,
                      ("Not enough memory for the scene: ask for smaller frames."), (nullptr));
  } catch (const std::invalid_argument& error) {
    GST_ELEMENT_ERROR(self, LIBRARY, SETTINGS, ("%s", error.what()), (nullptr));
  } catch (const std::exception& error) {
    GST_ELEMENT_ERROR(self, LIBRARY, FAILED, (nullptr), ("%s", error.what()));
  }
  return false;
}

static GstClockTime duration_of(const GstVideoInfo& info, gint64 frames) {
  return gst_util_uint64_scale(guint64(frames), guint64(GST_VIDEO_INFO_FPS_D(&info)) * GST_SECOND,
                               guint64(GST_VIDEO_INFO_FPS_N(&info)));
}

static GstClockTime time_of(const Private* priv, gint64 index) {
  return priv->first_time + duration_of(priv->info, index - priv->first_index);
}

static bool has_ended(const Private* priv, const GstSegment& segment) {
  if (priv->step < 0) return priv->index < 0 || time_of(priv, priv->index + 1) <= segment.start;
  if (priv->scene->length() > 0 && priv->index >= priv->scene->length()) return true;
  return GST_CLOCK_TIME_IS_VALID(segment.stop) && time_of(priv, priv->index) >= segment.stop;
}

static void write_colours(Private* priv, const Picture& picture, MappedVideoFrame* frame) {
  if (!priv->yuv) {
    qdmd::write_picture(picture, frame->view<uint8_t>());
    return;
  }
  priv->yuv->write(&frame->frame(), [&](int y) { return picture.row(y); });
}

// The scene's labels, each as a level of grey.
static void write_greys(Private* priv, uint8_t (*level_of)(uint8_t), MappedVideoFrame* frame) {
  const Plane& labels = priv->scene->labels();
  if (!priv->yuv) {
    qdmd::write_grey(labels, frame->view<uint8_t>(), level_of);
    return;
  }
  std::vector<uint8_t> greys(3 * labels.row_bytes());
  priv->yuv->write(&frame->frame(), [&](int y) {
    for (size_t i = 0; i < greys.size(); ++i) greys[i] = level_of(labels.row(y)[i / 3]);
    return greys.data();
  });
}

// Where the camera looks in the frame of that time.
static void tell_of_camera(GstQdmdSceneSrc* self, const Scene& scene, GstClockTime timestamp) {
  gst_element_post_message(
      GST_ELEMENT(self),
      gst_message_new_element(
          GST_OBJECT(self),
          gst_structure_new("qdmdscenesrc-camera", "timestamp", G_TYPE_UINT64, guint64(timestamp),
                            "camera-x", G_TYPE_DOUBLE, scene.shift_x(), "camera-y", G_TYPE_DOUBLE,
                            scene.shift_y(), "camera-angle", G_TYPE_DOUBLE,
                            scene.turn() * 180 / std::numbers::pi, nullptr)));
}

static GstFlowReturn gst_qdmd_scene_src_fill(GstPushSrc* source, GstBuffer* buffer) {
  GstQdmdSceneSrc* self = GST_QDMD_SCENE_SRC(source);
  Private* priv = self->priv;
  if (!priv->scene) return GST_FLOW_NOT_NEGOTIATED;
  if (has_ended(priv, GST_BASE_SRC(source)->segment)) return GST_FLOW_EOS;
  // Odd sizes are rounded up in memory: equal pictures are equal files.
  if (priv->yuv) gst_buffer_memset(buffer, 0, 0, gst_buffer_get_size(buffer));
  {
    MappedVideoFrame frame(&priv->info, buffer, GST_MAP_WRITE);
    if (!frame) {
      GST_ELEMENT_ERROR(self, RESOURCE, WRITE, (nullptr), ("could not map an output buffer"));
      return GST_FLOW_ERROR;
    }
    const bool made = guarded(self, [&] {
      switch (priv->playing.truth) {
        case TRUTH_NONE:
          priv->scene->render(priv->index, kFrame);
          write_colours(priv, priv->scene->frame(), &frame);
          break;
        case TRUTH_BACKGROUND:
          priv->scene->render(priv->index, kTruth);
          write_colours(priv, priv->scene->background(), &frame);
          break;
        case TRUTH_MASK:
          priv->scene->render(priv->index, kLabels);
          write_greys(priv, qdmd::mask_level, &frame);
          break;
        case TRUTH_LABELS:
          priv->scene->render(priv->index, kLabels);
          write_greys(priv, qdmd::label_level, &frame);
          break;
      }
    });
    if (!made) return GST_FLOW_ERROR;
  }
  GST_BUFFER_PTS(buffer) = time_of(priv, priv->index);
  GST_BUFFER_DTS(buffer) = GST_CLOCK_TIME_NONE;
  GST_BUFFER_DURATION(buffer) = time_of(priv, priv->index + 1) - GST_BUFFER_PTS(buffer);
  if (priv->playing.post_messages) tell_of_camera(self, *priv->scene, GST_BUFFER_PTS(buffer));
  GST_BUFFER_OFFSET(buffer) = guint64(priv->index);
  GST_BUFFER_OFFSET_END(buffer) = guint64(priv->index + 1);
  priv->index += priv->step;
  return GST_FLOW_OK;
}

// ---- Negotiation, seeking, queries --------------------------------------------------------------

static gboolean gst_qdmd_scene_src_start(GstBaseSrc* source) {
  GstQdmdSceneSrc* self = GST_QDMD_SCENE_SRC(source);
  Private* priv = self->priv;
  GST_OBJECT_LOCK(self);
  priv->playing = priv->settings;
  GST_OBJECT_UNLOCK(self);
  priv->pending.reset();
  priv->index = priv->first_index = 0;
  priv->first_time = 0;
  priv->step = 1;
  return guarded(self, [&] {
    const Settings& settings = priv->playing;
    priv->effects = parse_scene(settings.effects.empty() ? settings.scene
                                                         : settings.scene + "," + settings.effects);
  });
}

static gboolean gst_qdmd_scene_src_stop(GstBaseSrc* source) {
  Private* priv = GST_QDMD_SCENE_SRC(source)->priv;
  priv->scene.reset();
  GST_OBJECT_LOCK(source);
  gst_video_info_init(&priv->told_info);
  priv->told_stop = GST_CLOCK_TIME_NONE;
  GST_OBJECT_UNLOCK(source);
  return TRUE;
}

static GstCaps* gst_qdmd_scene_src_fixate(GstBaseSrc* source, GstCaps* caps) {
  caps = gst_caps_make_writable(caps);
  for (guint i = 0; i < gst_caps_get_size(caps); ++i) {
    GstStructure* structure = gst_caps_get_structure(caps, i);
    gst_structure_fixate_field_nearest_int(structure, "width", kWidth);
    gst_structure_fixate_field_nearest_int(structure, "height", kHeight);
    gst_structure_fixate_field_nearest_fraction(structure, "framerate", kRate, 1);
    if (gst_structure_has_field(structure, "pixel-aspect-ratio"))
      gst_structure_fixate_field_nearest_fraction(structure, "pixel-aspect-ratio", 1, 1);
    if (gst_structure_has_field(structure, "interlace-mode"))
      gst_structure_fixate_field_string(structure, "interlace-mode", "progressive");
  }
  return GST_BASE_SRC_CLASS(parent_class)->fixate(source, caps);
}

static gboolean gst_qdmd_scene_src_is_seekable(GstBaseSrc*) { return TRUE; }

// To the frame that is on at the segment's position; backwards, to the one before its stop, which
// is the scene's end where it has none. False where the scene has no end, either.
static bool locate(Private* priv, GstSegment& segment) {
  const auto rate = guint64(GST_VIDEO_INFO_FPS_N(&priv->info));
  const guint64 second = guint64(GST_VIDEO_INFO_FPS_D(&priv->info)) * GST_SECOND;
  const gint64 length = priv->scene->length();
  segment.duration = length > 0 ? duration_of(priv->info, length) : GST_CLOCK_TIME_NONE;
  priv->step = segment.rate < 0 ? -1 : 1;
  priv->first_index = 0;
  priv->first_time = 0;
  if (priv->step > 0) {
    priv->index = gint64(gst_util_uint64_scale(segment.position, rate, second));
    // Times of frames are rounded down.
    if (time_of(priv, priv->index + 1) <= segment.position) ++priv->index;
    return true;
  }
  if (!GST_CLOCK_TIME_IS_VALID(segment.stop)) {
    if (length == 0) return false;
    segment.stop = segment.duration;
  }
  // The base class stays where it is if a seek does not name the stop.
  segment.position = segment.stop;
  segment.offset = 0;
  priv->index = gint64(gst_util_uint64_scale_ceil(segment.stop, rate, second)) - 1;
  if (length > 0) priv->index = MIN(priv->index, length - 1);
  return true;
}

// True for a seek from the end of a scene that has none, or whose frame rate is not known yet, and
// for one backwards where there is no end. do_seek would refuse it, too, but that is too late: the
// base class has flushed by then, and sends no segment.
static bool refuses(GstQdmdSceneSrc* self, GstEvent* event) {
  if (GST_EVENT_TYPE(event) != GST_EVENT_SEEK) return false;
  gdouble rate;
  GstSeekType start_type, stop_type;
  gint64 stop;
  gst_event_parse_seek(event, &rate, nullptr, nullptr, &start_type, nullptr, &stop_type, &stop);
  GST_OBJECT_LOCK(self);
  const bool known = GST_VIDEO_INFO_FPS_N(&self->priv->told_info) > 0;
  const bool endless = known && self->priv->told_length == 0;
  const bool stays = stop_type == GST_SEEK_TYPE_NONE;
  const bool ends = stays ? GST_CLOCK_TIME_IS_VALID(self->priv->told_stop)
                          : stop_type == GST_SEEK_TYPE_SET && stop >= 0;
  GST_OBJECT_UNLOCK(self);
  // Forwards, many programs name the end itself as the stop: that is no stop.
  const bool from_end = start_type == GST_SEEK_TYPE_END ||
                        (stop_type == GST_SEEK_TYPE_END && (stop != 0 || rate < 0));
  if (from_end && (!known || endless)) {
    GST_WARNING_OBJECT(self,
                       "A seek from the end needs one: give the scene a length, and seek once "
                       "the element is paused.");
    return true;
  }
  if (!endless || rate >= 0 || ends) return false;
  GST_WARNING_OBJECT(self, "%s", kNoEnd);
  return true;
}

static gboolean gst_qdmd_scene_src_event(GstBaseSrc* source, GstEvent* event) {
  return !refuses(GST_QDMD_SCENE_SRC(source), event) &&
         GST_BASE_SRC_CLASS(parent_class)->event(source, event);
}

static gboolean gst_qdmd_scene_src_send_event(GstElement* element, GstEvent* event) {
  if (!refuses(GST_QDMD_SCENE_SRC(element), event))
    return GST_ELEMENT_CLASS(parent_class)->send_event(element, event);
  gst_event_unref(event);
  return FALSE;
}

static gboolean gst_qdmd_scene_src_do_seek(GstBaseSrc* source, GstSegment* segment) {
  Private* priv = GST_QDMD_SCENE_SRC(source)->priv;
  segment->time = segment->start;
  const bool found = !priv->scene || locate(priv, *segment);
  if (!priv->scene) priv->pending = *segment;
  GST_OBJECT_LOCK(source);
  priv->told_stop = segment->stop;
  GST_OBJECT_UNLOCK(source);
  return found;
}

static gboolean gst_qdmd_scene_src_set_caps(GstBaseSrc* source, GstCaps* caps) {
  GstQdmdSceneSrc* self = GST_QDMD_SCENE_SRC(source);
  Private* priv = self->priv;
  GstVideoInfo info;
  if (!gst_video_info_from_caps(&info, caps) || GST_VIDEO_INFO_FPS_N(&info) <= 0) return FALSE;
  // Time goes on from where the frame rate changes.
  if (priv->scene) {
    priv->first_time = time_of(priv, priv->index);
    priv->first_index = priv->index;
  }
  priv->info = info;
  GST_DEBUG_OBJECT(self, "frames of %dx%d", GST_VIDEO_INFO_WIDTH(&info),
                   GST_VIDEO_INFO_HEIGHT(&info));
  return guarded(self, [&] {
    SceneOptions options;
    options.width = GST_VIDEO_INFO_WIDTH(&info);
    options.height = GST_VIDEO_INFO_HEIGHT(&info);
    options.frames_per_second =
        double(GST_VIDEO_INFO_FPS_N(&info)) / double(GST_VIDEO_INFO_FPS_D(&info));
    options.seed = priv->playing.seed;
    priv->scene.emplace(options, priv->effects);
    priv->yuv.reset();
    if (!GST_VIDEO_INFO_IS_RGB(&info)) priv->yuv.emplace(info);
    if (priv->pending && !locate(priv, *priv->pending)) throw std::invalid_argument(kNoEnd);
    // It was found before anybody knew the scene's end, and is sent after the caps.
    GstSegment* const segment = &source->segment;
    const gint64 length = priv->scene->length();
    GST_OBJECT_LOCK(self);
    if (priv->pending) {
      *segment = *priv->pending;
      priv->told_stop = segment->stop;
    }
    // What seeks from the end go by.
    segment->duration = length > 0 ? duration_of(info, length) : GST_CLOCK_TIME_NONE;
    priv->told_info = info;
    priv->told_length = length;
    GST_OBJECT_UNLOCK(self);
    priv->pending.reset();
  });
}

static gboolean gst_qdmd_scene_src_decide_allocation(GstBaseSrc* source, GstQuery* query) {
  GstCaps* caps = nullptr;
  gst_query_parse_allocation(query, &caps, nullptr);
  GstVideoInfo info;
  if (!caps || !gst_video_info_from_caps(&info, caps)) return FALSE;

  const bool proposed = gst_query_get_n_allocation_pools(query) > 0;
  GstBufferPool* pool = nullptr;
  guint size = guint(info.size), least = 0, most = 0;
  if (proposed) gst_query_parse_nth_allocation_pool(query, 0, &pool, &size, &least, &most);
  size = MAX(size, guint(info.size));
  if (!pool) pool = gst_video_buffer_pool_new();
  GstStructure* config = gst_buffer_pool_get_config(pool);
  gst_buffer_pool_config_set_params(config, caps, size, least, most);
  if (gst_query_find_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr))
    gst_buffer_pool_config_add_option(config, GST_BUFFER_POOL_OPTION_VIDEO_META);
  gst_buffer_pool_set_config(pool, config);
  if (proposed)
    gst_query_set_nth_allocation_pool(query, 0, pool, size, least, most);
  else
    gst_query_add_allocation_pool(query, pool, size, least, most);
  gst_object_unref(pool);
  return GST_BASE_SRC_CLASS(parent_class)->decide_allocation(source, query);
}

static gboolean gst_qdmd_scene_src_query(GstBaseSrc* source, GstQuery* query) {
  Private* priv = GST_QDMD_SCENE_SRC(source)->priv;
  GST_OBJECT_LOCK(source);
  const GstVideoInfo info = priv->told_info;
  const gint64 length = priv->told_length;
  GST_OBJECT_UNLOCK(source);
  const bool negotiated = GST_VIDEO_INFO_FPS_N(&info) > 0;
  switch (GST_QUERY_TYPE(query)) {
    case GST_QUERY_CONVERT: {
      GstFormat from, to;
      gint64 value = 0, converted = 0;
      gst_query_parse_convert(query, &from, &value, &to, &converted);
      if (!negotiated || !gst_video_info_convert(&info, from, value, to, &converted)) return FALSE;
      gst_query_set_convert(query, from, value, to, converted);
      return TRUE;
    }
    case GST_QUERY_DURATION: {
      GstFormat format;
      gst_query_parse_duration(query, &format, nullptr);
      if (!negotiated || length == 0) break;
      if (format == GST_FORMAT_DEFAULT)
        gst_query_set_duration(query, format, length);
      else if (format == GST_FORMAT_TIME)
        gst_query_set_duration(query, format, gint64(duration_of(info, length)));
      else
        break;
      return TRUE;
    }
    case GST_QUERY_LATENCY:
      if (!negotiated) return FALSE;
      gst_query_set_latency(query, gst_base_src_is_live(source), duration_of(info, 1),
                            GST_CLOCK_TIME_NONE);
      return TRUE;
    default:
      break;
  }
  return GST_BASE_SRC_CLASS(parent_class)->query(source, query);
}

static void gst_qdmd_scene_src_get_times(GstBaseSrc* source, GstBuffer* buffer, GstClockTime* start,
                                         GstClockTime* end) {
  *start = *end = GST_CLOCK_TIME_NONE;
  if (!gst_base_src_is_live(source) || !GST_BUFFER_PTS_IS_VALID(buffer)) return;
  *start = GST_BUFFER_PTS(buffer);
  *end = *start + GST_BUFFER_DURATION(buffer);
}

// ---- Class --------------------------------------------------------------------------------------

static void gst_qdmd_scene_src_init(GstQdmdSceneSrc* self) {
  self->priv = new Private;
  gst_video_info_init(&self->priv->info);
  gst_video_info_init(&self->priv->told_info);
  gst_base_src_set_format(GST_BASE_SRC(self), GST_FORMAT_TIME);
}

static void gst_qdmd_scene_src_finalize(GObject* object) {
  delete GST_QDMD_SCENE_SRC(object)->priv;
  G_OBJECT_CLASS(parent_class)->finalize(object);
}

static std::string scene_blurb() {
  std::string text = "A preset, or effects such as noise=3,jitter=1.5:frequency=2. Presets:";
  for (const auto& preset : presets()) text.append(" ").append(preset.name);
  text.append(". Effects, each of them a preset too:");
  for (const EffectInfo* info : effects()) text.append(" ").append(info->name);
  return text;
}

static void gst_qdmd_scene_src_class_init(GstQdmdSceneSrcClass* klass) {
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  GstBaseSrcClass* source_class = GST_BASE_SRC_CLASS(klass);
  const auto ready =
      GParamFlags(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);
  const Settings defaults;

  object_class->set_property = gst_qdmd_scene_src_set_property;
  object_class->get_property = gst_qdmd_scene_src_get_property;
  object_class->finalize = gst_qdmd_scene_src_finalize;

  static const std::string blurb = scene_blurb();
  g_object_class_install_property(
      object_class, PROP_SCENE,
      g_param_spec_string("scene", "Scene", blurb.c_str(), defaults.scene.c_str(), ready));
  g_object_class_install_property(
      object_class, PROP_EFFECTS,
      g_param_spec_string("effects", "Effects",
                          "Effects in addition to those of the scene, in the same notation; of two "
                          "with one name these hold",
                          "", ready));
  g_object_class_install_property(
      object_class, PROP_SEED,
      g_param_spec_uint64("seed", "Seed",
                          "Decides every colour, way and random number: equal seeds give equal "
                          "frames",
                          0, G_MAXUINT64, 0, ready));
  g_object_class_install_property(
      object_class, PROP_TRUTH,
      g_param_spec_enum("truth", "Truth", "Send the ground truth of the same frames instead",
                        gst_qdmd_scene_src_truth_get_type(), TRUTH_NONE, ready));
  g_object_class_install_property(
      object_class, PROP_POST_MESSAGES,
      g_param_spec_boolean(
          "post-messages", "Post messages",
          "Post an element message `qdmdscenesrc-camera` for each frame: its timestamp, and where "
          "the camera looks beside its place. camera-x and camera-y are in pixels to the right and "
          "down, camera-angle in degrees clockwise",
          FALSE, ready));
  g_object_class_install_property(
      object_class, PROP_IS_LIVE,
      g_param_spec_boolean("is-live", "Is live",
                           "Make each frame when its time comes, like a camera", FALSE, ready));

  gst_element_class_set_static_metadata(
      element_class, "Simulated scene", "Source/Video",
      "Simulates a street scene of named effects, with its true background and mask",
      "The gst-qdmd authors <gst-qdmd@localhost>");
  gst_element_class_add_pad_template(
      element_class,
      gst_pad_template_new("src", GST_PAD_SRC, GST_PAD_ALWAYS,
                           gst_caps_from_string("video/x-raw, format=(string)" QDMD_FORMATS
                                                ", width=[ 1, 16384 ], height=[ 1, 16384 ], "
                                                "framerate=[ 1/2147483647, 2147483647/1 ]")));
  gst_type_mark_as_plugin_api(gst_qdmd_scene_src_truth_get_type(), GstPluginAPIFlags(0));

  source_class->start = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_start);
  source_class->stop = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_stop);
  source_class->fixate = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_fixate);
  source_class->set_caps = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_set_caps);
  source_class->decide_allocation = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_decide_allocation);
  source_class->is_seekable = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_is_seekable);
  element_class->send_event = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_send_event);
  source_class->event = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_event);
  source_class->do_seek = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_do_seek);
  source_class->query = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_query);
  source_class->get_times = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_get_times);
  GST_PUSH_SRC_CLASS(klass)->fill = GST_DEBUG_FUNCPTR(gst_qdmd_scene_src_fill);
}
