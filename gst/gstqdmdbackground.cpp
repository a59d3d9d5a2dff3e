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
 * In #GstQdmdBackground:mode `batch` a frame waits for the last one of its window: the element
 * reports a latency of (window-size - 1) frames. Keep audio in step with a queue of that
 * max-size-time. Its window takes 3 x window-size x width x height bytes.
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

#include <deque>
#include <exception>
#include <memory>
#include <new>
#include <utility>

#include "core/background/engine.h"
#include "core/regions/regions.h"
#include "gst/frameio.h"
#include "gst/gstqdmdenums.h"
#include "gst/gstqdmdsettings.h"
#include "gst/solvereport.h"

GST_DEBUG_CATEGORY_STATIC(qdmd_background_debug);
#define GST_CAT_DEFAULT qdmd_background_debug

namespace {

using qdmd::Engine;
using qdmd::MappedVideoFrame;
using qdmd::Output;
using qdmd::Settings;
using qdmd::Status;

// The latency of video without a frame rate is that of this rate.
constexpr int kAssumedRate = 25;

// A gap between two frames beyond which time is broken; cameras may lose some frames.
constexpr GstClockTime kMostGap = GST_SECOND;
constexpr int kMostGapFrames = 5;

constexpr guint kStatsProperty = qdmd::kFirstFreeProperty,
                kBackgroundProperty = qdmd::kFirstFreeProperty + 1;

#define QDMD_FORMATS \
  "{ RGBx, BGRx, xRGB, xBGR, RGBA, BGRA, ARGB, ABGR, RGB, BGR, GBR, I420, NV12, GRAY8 }"

struct UnrefBuffer {
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
};
using BufferPtr = std::unique_ptr<GstBuffer, UnrefBuffer>;

struct UnrefSample {
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
};
using SamplePtr = std::unique_ptr<GstSample, UnrefSample>;

struct Private {
  // Protected by the object lock.
  Settings settings;
  GstClockTime latency = 0;
  qdmd::Counters counters;
  bool reset_asked = false;
  qdmd::SolveReport report;
  SamplePtr background;

  // Protected by the stream lock.
  Engine engine;
  // The metadata of the frames that the engine holds, oldest first: buffers without memory, so that
  // upstream's pools never wait for a window.
  std::deque<BufferPtr> shells;
  qdmd::FrameIo io;
  std::vector<guint8> mask, residual;  // for regions
  guint64 solves_told = 0;
  GstClockTime next_pts = GST_CLOCK_TIME_NONE;  // where the frame after the newest is expected
};

}  // namespace

struct _GstQdmdBackground {
  GstVideoFilter parent;
  Private* priv;
};

#define gst_qdmd_background_parent_class parent_class
G_DEFINE_TYPE_WITH_CODE(GstQdmdBackground, gst_qdmd_background, GST_TYPE_VIDEO_FILTER,
                        GST_DEBUG_CATEGORY_INIT(qdmd_background_debug, "qdmdbackground", 0,
                                                "Q-DMD background separation"))
GST_ELEMENT_REGISTER_DEFINE(qdmdbackground, "qdmdbackground", GST_RANK_NONE,
                            GST_TYPE_QDMD_BACKGROUND)

// ---- Properties ---------------------------------------------------------------------------------

static void gst_qdmd_background_set_property(GObject* object, guint id, const GValue* value,
                                             GParamSpec* spec) {
  Private* priv = GST_QDMD_BACKGROUND(object)->priv;
  GST_OBJECT_LOCK(object);
  const bool known = qdmd::set_setting(&priv->settings, id, value);
  GST_OBJECT_UNLOCK(object);
  if (!known) G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

static void gst_qdmd_background_get_property(GObject* object, guint id, GValue* value,
                                             GParamSpec* spec) {
  Private* priv = GST_QDMD_BACKGROUND(object)->priv;
  GST_OBJECT_LOCK(object);
  bool known = qdmd::get_setting(priv->settings, id, value);
  if (id == kStatsProperty) {
    g_value_take_boxed(value, qdmd::make_stats(priv->report, priv->counters));
    known = true;
  }
  if (id == kBackgroundProperty) {
    g_value_set_boxed(value, priv->background.get());
    known = true;
  }
  GST_OBJECT_UNLOCK(object);
  if (!known) G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

// ---- Frames through the engine ------------------------------------------------------------------

// Posts what a refused engine call said. Called without locks.
static void post_status(GstQdmdBackground* self, const Status& status) {
  switch (status.code) {
    case Status::Code::too_much_memory:
      GST_ELEMENT_ERROR(self, RESOURCE, NO_SPACE_LEFT, ("%s", status.message.c_str()), (nullptr));
      break;
    case Status::Code::invalid_options:
      GST_ELEMENT_ERROR(self, LIBRARY, SETTINGS, ("%s", status.message.c_str()), (nullptr));
      break;
    default:
      GST_ELEMENT_ERROR(self, LIBRARY, FAILED, (nullptr), ("%s", status.message.c_str()));
      break;
  }
}

// Runs `action` (returning Status); true if it succeeded, else an error is posted. No exception
// gets past this.
template <typename Action>
static bool guarded(GstQdmdBackground* self, Action action) {
  try {
    const Status status = action();
    if (status.ok()) return true;
    post_status(self, status);
  } catch (const std::bad_alloc&) {
    GST_ELEMENT_ERROR(self, RESOURCE, NO_SPACE_LEFT,
                      ("Not enough memory for the window: lower window-size or scale the video "
                       "down."),
                      (nullptr));
  } catch (const std::exception& error) {
    GST_ELEMENT_ERROR(self, LIBRARY, FAILED, (nullptr), ("%s", error.what()));
  }
  return false;
}

static void drop_frames(GstQdmdBackground* self) {
  self->priv->engine.flush();
  self->priv->shells.clear();
  self->priv->next_pts = GST_CLOCK_TIME_NONE;
}

// Copies what others may want to know of the engine.
static void publish_report(GstQdmdBackground* self, guint64 frames_in, guint64 frames_out) {
  Private* priv = self->priv;
  GST_OBJECT_LOCK(self);
  priv->counters.frames_in += frames_in;
  priv->counters.frames_out += frames_out;
  priv->counters.solves = priv->engine.solves();
  priv->report = priv->engine.report();
  GST_OBJECT_UNLOCK(self);
}

// The newest background as a buffer of the output's format, or null.
static BufferPtr make_background(GstQdmdBackground* self) {
  const GstVideoInfo* info = &GST_VIDEO_FILTER(self)->out_info;
  BufferPtr buffer(gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(info), nullptr));
  if (!buffer) return nullptr;
  bool written = false;
  {
    MappedVideoFrame frame(info, buffer.get(), GST_MAP_WRITE);
    if (!frame) return nullptr;
    const bool done = guarded(self, [&] {
      self->priv->io.write(&frame, Output::background, [&](const qdmd::MutableImageView& view) {
        written = self->priv->engine.write_background(view);
      });
      return Status();
    });
    written = written && done;
  }
  if (!written) return nullptr;
  return buffer;
}

// Says what a new solve found. The frames that wait are those that come out with it.
static void tell_of_solve(GstQdmdBackground* self) {
  Private* priv = self->priv;
  if (priv->engine.solves() == priv->solves_told || priv->shells.empty()) return;
  priv->solves_told = priv->engine.solves();
  GstBuffer *first = priv->shells.front().get(), *last = priv->shells.back().get();
  const GstClockTime timestamp = GST_BUFFER_PTS(first);
  GstClockTime duration = GST_CLOCK_TIME_NONE;
  if (GST_BUFFER_PTS_IS_VALID(first) && GST_BUFFER_PTS_IS_VALID(last) &&
      GST_BUFFER_PTS(last) >= timestamp)
    duration = GST_BUFFER_PTS(last) - timestamp +
               (GST_BUFFER_DURATION_IS_VALID(last) ? GST_BUFFER_DURATION(last) : 0);

  const GstSegment& segment = GST_BASE_TRANSFORM(self)->segment;
  SamplePtr sample;
  GstCaps* caps = gst_pad_get_current_caps(GST_BASE_TRANSFORM_SRC_PAD(self));
  if (BufferPtr picture = caps ? make_background(self) : nullptr) {
    GST_BUFFER_PTS(picture.get()) = timestamp;
    GST_BUFFER_DURATION(picture.get()) = duration;
    sample.reset(gst_sample_new(picture.get(), caps, &segment, nullptr));
  }
  if (caps) gst_caps_unref(caps);

  GST_OBJECT_LOCK(self);
  const bool post = priv->settings.post_messages;
  if (sample) std::swap(priv->background, sample);
  GST_OBJECT_UNLOCK(self);
  // The old sample ends here, without the lock.
  sample.reset();
  if (post)
    gst_element_post_message(
        GST_ELEMENT(self),
        gst_message_new_element(
            GST_OBJECT(self),
            qdmd::make_solve_message(priv->engine.report(), segment, timestamp, duration)));
}

// Sets controlled properties to what they are at the time of `buffer`.
static void follow_controllers(GstQdmdBackground* self, GstBuffer* buffer) {
  const GstSegment& segment = GST_BASE_TRANSFORM(self)->segment;
  if (segment.format != GST_FORMAT_TIME || !GST_BUFFER_PTS_IS_VALID(buffer)) return;
  const guint64 time =
      gst_segment_to_stream_time(&segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  if (GST_CLOCK_TIME_IS_VALID(time)) gst_object_sync_values(GST_OBJECT(self), time);
}

// Regions of the frame that comes out next.
static std::vector<qdmd::Region> next_regions(GstQdmdBackground* self, int least_area) {
  Private* priv = self->priv;
  const GstVideoInfo* info = &GST_VIDEO_FILTER(self)->out_info;
  const int width = GST_VIDEO_INFO_WIDTH(info), height = GST_VIDEO_INFO_HEIGHT(info);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  priv->mask.resize(pixels);
  priv->residual.resize(pixels);
  priv->engine.foreground(priv->mask.data(), priv->residual.data());
  return qdmd::find_regions(priv->mask.data(), priv->residual.data(), width, height, least_area);
}

static void attach(GstBuffer* buffer, const std::vector<qdmd::Region>& regions) {
  for (const qdmd::Region& region : regions) {
    auto* meta = gst_buffer_add_video_region_of_interest_meta(buffer, "foreground", guint(region.x),
                                                              guint(region.y), guint(region.width),
                                                              guint(region.height));
    gst_video_region_of_interest_meta_add_param(
        meta, gst_structure_new("foreground", "area", G_TYPE_UINT, guint(region.area),
                                "mean-residual", G_TYPE_DOUBLE, region.mean_residual, nullptr));
  }
}

// The next ready frame as a buffer from the output pool, or null with OK where none is ready.
static GstFlowReturn next_output(GstQdmdBackground* self, GstBuffer** out) {
  Private* priv = self->priv;
  GstBaseTransform* trans = GST_BASE_TRANSFORM(self);
  *out = nullptr;
  if (!priv->engine.ready()) return GST_FLOW_OK;

  const BufferPtr shell = std::move(priv->shells.front());
  priv->shells.pop_front();
  follow_controllers(self, shell.get());
  GST_OBJECT_LOCK(self);
  const Settings settings = priv->settings;
  GST_OBJECT_UNLOCK(self);

  GstBuffer* made = nullptr;
  const GstFlowReturn flow =
      GST_BASE_TRANSFORM_CLASS(parent_class)->prepare_output_buffer(trans, shell.get(), &made);
  BufferPtr buffer(made);
  if (flow != GST_FLOW_OK || !buffer) return flow;
  std::vector<qdmd::Region> regions;
  {
    MappedVideoFrame frame(&GST_VIDEO_FILTER(self)->out_info, buffer.get(), GST_MAP_WRITE);
    if (!frame) {
      GST_ELEMENT_ERROR(self, RESOURCE, WRITE, (nullptr), ("could not map an output buffer"));
      return GST_FLOW_ERROR;
    }
    const bool written = guarded(self, [&] {
      priv->engine.set_foreground_threshold(settings.engine.foreground_threshold);
      if (settings.regions) regions = next_regions(self, settings.regions_min_area);
      priv->io.write(&frame, settings.output, [&](const qdmd::MutableImageView& view) {
        priv->engine.pop(settings.output, view);
      });
      return Status();
    });
    if (!written) return GST_FLOW_ERROR;
  }
  attach(buffer.get(), regions);
  publish_report(self, 0, 1);
  *out = buffer.release();
  return GST_FLOW_OK;
}

// Solves for what is left and pushes it; the next frame begins a new window. The caller holds the
// stream lock: sink events that are serialized, and the streaming thread.
static GstFlowReturn drain(GstQdmdBackground* self) {
  Private* priv = self->priv;
  if (!priv->engine.configured()) return GST_FLOW_OK;
  GST_DEBUG_OBJECT(self, "draining %u frames", guint(priv->shells.size()));
  GstFlowReturn flow = GST_FLOW_OK;
  if (!guarded(self, [&] { return priv->engine.drain(); })) flow = GST_FLOW_ERROR;
  if (flow == GST_FLOW_OK) tell_of_solve(self);
  while (flow == GST_FLOW_OK && priv->engine.ready()) {
    GstBuffer* buffer = nullptr;
    flow = next_output(self, &buffer);
    if (flow == GST_FLOW_OK && buffer)
      flow = gst_pad_push(GST_BASE_TRANSFORM_SRC_PAD(self), buffer);
  }
  if (flow == GST_FLOW_OK) return flow;
  GST_DEBUG_OBJECT(self, "dropped %u frames: %s", guint(priv->shells.size()),
                   gst_flow_get_name(flow));
  drop_frames(self);
  return flow;
}

// True where `input` does not follow the frame before: time goes back, or leaves out more than a
// camera loses. Notes where the next frame is expected.
static bool time_jumps(GstQdmdBackground* self, GstBuffer* input) {
  GstClockTime* next = &self->priv->next_pts;
  const GstVideoInfo* info = &GST_VIDEO_FILTER(self)->in_info;
  const GstClockTime expected = *next, pts = GST_BUFFER_PTS(input);
  const bool has_rate = GST_VIDEO_INFO_FPS_N(info) > 0;
  GstClockTime frame = GST_BUFFER_DURATION(input);
  if (has_rate)
    frame = gst_util_uint64_scale(GST_SECOND, guint64(GST_VIDEO_INFO_FPS_D(info)),
                                  guint64(GST_VIDEO_INFO_FPS_N(info)));
  *next = GST_CLOCK_TIME_NONE;
  // Frames of reverse playback come in reverse order.
  if (!GST_CLOCK_TIME_IS_VALID(pts) || GST_BASE_TRANSFORM(self)->segment.rate < 0) return false;
  if (!GST_CLOCK_TIME_IS_VALID(frame)) frame = 0;
  *next = pts + frame;
  if (!GST_CLOCK_TIME_IS_VALID(expected)) return false;
  // Rounded timestamps may fall short by some.
  if (pts + MAX(frame, 10 * GST_MSECOND) < expected) return true;
  // Without a rate nobody knows how long a frame lasts.
  return has_rate && pts > expected + MAX(kMostGap, kMostGapFrames * frame);
}

static GstFlowReturn gst_qdmd_background_submit_input_buffer(GstBaseTransform* trans,
                                                             gboolean is_discont,
                                                             GstBuffer* input) {
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(trans);
  Private* priv = self->priv;
  follow_controllers(self, input);
  GST_OBJECT_LOCK(self);
  const bool reset = std::exchange(priv->reset_asked, false);
  const bool freeze = priv->settings.freeze;
  const int threads = priv->settings.engine.threads;
  GST_OBJECT_UNLOCK(self);
  // The base class keeps is_discont set until something was pushed, which can be a window later:
  // the buffer's own flag says where time breaks.
  const bool jump = time_jumps(self, input);
  if (jump) GST_DEBUG_OBJECT(self, "time jumps: a new window begins");
  if (GST_BUFFER_IS_DISCONT(input) || jump || reset) {
    const GstFlowReturn flow = drain(self);
    if (flow != GST_FLOW_OK) {
      gst_buffer_unref(input);
      return flow;
    }
  }
  if (reset) drop_frames(self);

  // The parent renegotiates where that is due and leaves the buffer in queued_buf.
  const GstFlowReturn flow =
      GST_BASE_TRANSFORM_CLASS(parent_class)->submit_input_buffer(trans, is_discont, input);
  if (flow != GST_FLOW_OK) return flow;
  const BufferPtr buffer(trans->queued_buf);
  trans->queued_buf = nullptr;
  if (!buffer) return GST_FLOW_OK;
  // The base class asks for frames until there is none, or until downstream refuses one (it has
  // ended, or is not linked); upstream may go on all the same. Nobody wants what is left.
  if (priv->engine.ready()) drop_frames(self);

  BufferPtr shell(gst_buffer_new());
  gst_buffer_copy_into(
      shell.get(), buffer.get(),
      GstBufferCopyFlags(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS | GST_BUFFER_COPY_META),
      0, gsize(-1));
  {
    const MappedVideoFrame frame(&GST_VIDEO_FILTER(self)->in_info, buffer.get(), GST_MAP_READ);
    if (!frame) {
      GST_ELEMENT_ERROR(self, STREAM, FORMAT,
                        ("A buffer does not hold a frame of the negotiated caps."), (nullptr));
      return GST_FLOW_ERROR;
    }
    const bool taken = guarded(self, [&] {
      priv->shells.push_back(std::move(shell));
      priv->engine.set_freeze(freeze);
      priv->engine.set_threads(threads);
      return priv->engine.push(priv->io.read(frame));
    });
    if (!taken) {
      drop_frames(self);
      return GST_FLOW_ERROR;
    }
  }
  publish_report(self, 1, 0);
  tell_of_solve(self);
  return GST_FLOW_OK;
}

static GstFlowReturn gst_qdmd_background_generate_output(GstBaseTransform* trans, GstBuffer** out) {
  return next_output(GST_QDMD_BACKGROUND(trans), out);
}

// GstVideoFilter works in place on elements without this function; frames never come here, they go
// through submit_input_buffer and generate_output.
static GstFlowReturn gst_qdmd_background_transform_frame(GstVideoFilter*, GstVideoFrame*,
                                                         GstVideoFrame*) {
  return GST_FLOW_NOT_SUPPORTED;
}

// ---- Negotiation, events, queries ---------------------------------------------------------------

static gboolean gst_qdmd_background_set_info(GstVideoFilter* filter, GstCaps*, GstVideoInfo* in,
                                             GstCaps*, GstVideoInfo*) {
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(filter);
  Private* priv = self->priv;

  GST_OBJECT_LOCK(self);
  const Settings settings = priv->settings;
  GST_OBJECT_UNLOCK(self);

  priv->shells.clear();
  priv->solves_told = 0;
  priv->next_pts = GST_CLOCK_TIME_NONE;
  const bool configured = guarded(self, [&] {
    return priv->engine.configure(settings.engine, GST_VIDEO_INFO_WIDTH(in),
                                  GST_VIDEO_INFO_HEIGHT(in));
  });
  if (!configured) return FALSE;

  const bool has_rate = GST_VIDEO_INFO_FPS_N(in) > 0 && GST_VIDEO_INFO_FPS_D(in) > 0;
  const guint64 rate_n = has_rate ? guint64(GST_VIDEO_INFO_FPS_N(in)) : kAssumedRate;
  const guint64 rate_d = has_rate ? guint64(GST_VIDEO_INFO_FPS_D(in)) : 1;
  const guint64 delay =
      settings.engine.mode == qdmd::Mode::live ? 0 : guint64(settings.engine.window_size - 1);
  const GstClockTime latency = gst_util_uint64_scale(delay * GST_SECOND, rate_d, rate_n);
  GST_OBJECT_LOCK(self);
  const bool changed = latency != priv->latency;
  priv->latency = latency;
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
        drain(self);
      break;
    }
    case GST_EVENT_STREAM_START:
      // Another stream, another scene.
      drain(self);
      drop_frames(self);
      break;
    case GST_EVENT_SEGMENT:
    case GST_EVENT_SEGMENT_DONE:
    case GST_EVENT_GAP:
    case GST_EVENT_EOS:
      // The flow of these frames is not the event's: EOS goes on whatever they met.
      drain(self);
      break;
    case GST_EVENT_FLUSH_STOP:
      drop_frames(self);
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
  const GstClockTime own = self->priv->latency;
  GST_OBJECT_UNLOCK(self);
  min += own;
  if (GST_CLOCK_TIME_IS_VALID(max)) max += own;
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
  Private* priv = self->priv;
  GST_OBJECT_LOCK(self);
  priv->counters = {};
  priv->report = qdmd::SolveReport();
  const SamplePtr old = std::move(priv->background);
  GST_OBJECT_UNLOCK(self);
  return TRUE;
}

static gboolean gst_qdmd_background_stop(GstBaseTransform* trans) {
  GstQdmdBackground* self = GST_QDMD_BACKGROUND(trans);
  drop_frames(self);
  self->priv->engine.close();
  return TRUE;
}

// ---- Class --------------------------------------------------------------------------------------

static void gst_qdmd_background_finalize(GObject* object) {
  delete GST_QDMD_BACKGROUND(object)->priv;
  G_OBJECT_CLASS(parent_class)->finalize(object);
}

static void gst_qdmd_background_init(GstQdmdBackground* self) {
  self->priv = new Private();
  // A decomposition in time needs every frame.
  gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(self), FALSE);
}

static void gst_qdmd_background_reset(GstQdmdBackground* self) {
  GST_OBJECT_LOCK(self);
  self->priv->reset_asked = true;
  GST_OBJECT_UNLOCK(self);
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
      object_class, kStatsProperty,
      g_param_spec_boxed("stats", "Statistics",
                         "Counters, and facts about the newest solve: rank, lambda (real and "
                         "imaginary part), omega in rad/frame, residual, condition, "
                         "foreground-ratio (0 to 1), gram-time and solve-time in seconds",
                         GST_TYPE_STRUCTURE,
                         GParamFlags(G_PARAM_READABLE | G_PARAM_STATIC_STRINGS)));
  g_object_class_install_property(
      object_class, kBackgroundProperty,
      g_param_spec_boxed("background", "Background",
                         "The newest background picture in the output's caps, with the time of the "
                         "frames that came out with its solve; null before the first solve",
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
        gst_qdmd_background_solver_get_type()})
    gst_type_mark_as_plugin_api(type, GstPluginAPIFlags(0));
}
