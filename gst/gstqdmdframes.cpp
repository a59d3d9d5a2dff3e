#include "gst/gstqdmdframes.h"

#include <exception>
#include <new>
#include <utility>

#include "core/background/stopwatch.h"
#include "core/regions/regions.h"

GST_DEBUG_CATEGORY_EXTERN(qdmd_background_debug);
#define GST_CAT_DEFAULT qdmd_background_debug

namespace qdmd {
namespace {

// A gap between two frames beyond which time is broken; cameras may lose some frames.
constexpr GstClockTime kMostGap = GST_SECOND;
constexpr int kMostGapFrames = 5;

}  // namespace

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

void drop_frames(GstQdmdBackground* self) {
  self->frames->engine.flush();
  self->frames->shells.clear();
  self->frames->next_pts = GST_CLOCK_TIME_NONE;
}

// Copies what others may want to know of the engine.
static void publish_report(GstQdmdBackground* self, guint64 frames_in, guint64 frames_out) {
  Frames* frames = self->frames;
  GST_OBJECT_LOCK(self);
  frames->counters.frames_in += frames_in;
  frames->counters.frames_out += frames_out;
  frames->counters.solves = frames->engine.solves();
  frames->counters.solve_period = guint(frames->engine.time_budget().effort().period);
  frames->counters.time_per_frame = 1000 * frames->engine.time_budget().predicted();
  frames->report = frames->engine.report();
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
      self->frames->io.write(&frame, Output::background, [&](const MutableImageView& view) {
        written = self->frames->engine.write_background(view);
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
  Frames* frames = self->frames;
  if (frames->engine.solves() == frames->solves_told || frames->shells.empty()) return;
  frames->solves_told = frames->engine.solves();
  GstBuffer *first = frames->shells.front().get(), *last = frames->shells.back().get();
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
  const bool post = frames->settings.post_messages;
  const Counters counters = frames->counters;
  if (sample) std::swap(frames->background, sample);
  GST_OBJECT_UNLOCK(self);
  // The old sample ends here, without the lock.
  sample.reset();
  if (post)
    gst_element_post_message(
        GST_ELEMENT(self),
        gst_message_new_element(
            GST_OBJECT(self),
            make_solve_message(frames->engine.report(), counters, segment, timestamp, duration)));
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
static std::vector<Region> next_regions(GstQdmdBackground* self, int least_area) {
  Frames* frames = self->frames;
  const GstVideoInfo* info = &GST_VIDEO_FILTER(self)->out_info;
  const int width = GST_VIDEO_INFO_WIDTH(info), height = GST_VIDEO_INFO_HEIGHT(info);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  frames->mask.resize(pixels);
  frames->residual.resize(pixels);
  frames->engine.foreground(frames->mask.data(), frames->residual.data());
  return find_regions(frames->mask.data(), frames->residual.data(), width, height, least_area);
}

static void attach(GstBuffer* buffer, const std::vector<Region>& regions) {
  gint id = 0;
  for (const Region& region : regions) {
    auto* meta = gst_buffer_add_video_region_of_interest_meta(buffer, "foreground", guint(region.x),
                                                              guint(region.y), guint(region.width),
                                                              guint(region.height));
    // Languages that cannot walk through metadata ask for a number.
    meta->id = id++;
    gst_video_region_of_interest_meta_add_param(
        meta, gst_structure_new("foreground", "area", G_TYPE_UINT, guint(region.area),
                                "mean-residual", G_TYPE_DOUBLE, region.mean_residual, nullptr));
  }
}

GstFlowReturn next_output(GstQdmdBackground* self, GstBuffer** out) {
  Frames* frames = self->frames;
  GstBaseTransform* trans = GST_BASE_TRANSFORM(self);
  *out = nullptr;
  if (!frames->engine.ready()) return GST_FLOW_OK;

  const BufferPtr shell = std::move(frames->shells.front());
  frames->shells.pop_front();
  follow_controllers(self, shell.get());
  GST_OBJECT_LOCK(self);
  const Settings settings = frames->settings;
  GST_OBJECT_UNLOCK(self);

  GstBuffer* made = nullptr;
  const GstFlowReturn flow =
      GST_BASE_TRANSFORM_GET_CLASS(self)->prepare_output_buffer(trans, shell.get(), &made);
  BufferPtr buffer(made);
  if (flow != GST_FLOW_OK || !buffer) return flow;
  std::vector<Region> regions;
  {
    MappedVideoFrame frame(&GST_VIDEO_FILTER(self)->out_info, buffer.get(), GST_MAP_WRITE);
    if (!frame) {
      GST_ELEMENT_ERROR(self, RESOURCE, WRITE, (nullptr), ("could not map an output buffer"));
      return GST_FLOW_ERROR;
    }
    const bool written = guarded(self, [&] {
      frames->engine.set_foreground_threshold(settings.engine.foreground_threshold);
      double all = 0, popping = 0;
      {
        const Stopwatch watch(&all);
        if (settings.regions) regions = next_regions(self, settings.regions_min_area);
        frames->io.write(&frame, settings.output, [&](const MutableImageView& view) {
          const Stopwatch pop_watch(&popping);
          frames->engine.pop(settings.output, view);
        });
      }
      frames->engine.add_time(all - popping);
      return Status();
    });
    if (!written) return GST_FLOW_ERROR;
  }
  attach(buffer.get(), regions);
  publish_report(self, 0, 1);
  *out = buffer.release();
  return GST_FLOW_OK;
}

GstFlowReturn drain(GstQdmdBackground* self) {
  Frames* frames = self->frames;
  if (!frames->engine.configured()) return GST_FLOW_OK;
  GST_DEBUG_OBJECT(self, "draining %u frames", guint(frames->shells.size()));
  GstFlowReturn flow = GST_FLOW_OK;
  if (!guarded(self, [&] { return frames->engine.drain(); })) flow = GST_FLOW_ERROR;
  if (flow == GST_FLOW_OK) tell_of_solve(self);
  while (flow == GST_FLOW_OK && frames->engine.ready()) {
    GstBuffer* buffer = nullptr;
    flow = next_output(self, &buffer);
    if (flow == GST_FLOW_OK && buffer)
      flow = gst_pad_push(GST_BASE_TRANSFORM_SRC_PAD(self), buffer);
  }
  if (flow == GST_FLOW_OK) return flow;
  GST_DEBUG_OBJECT(self, "dropped %u frames: %s", guint(frames->shells.size()),
                   gst_flow_get_name(flow));
  drop_frames(self);
  return flow;
}

// True where `input` does not follow the frame before: time goes back, or leaves out more than a
// camera loses. Notes where the next frame is expected.
static bool time_jumps(GstQdmdBackground* self, GstBuffer* input) {
  GstClockTime* next = &self->frames->next_pts;
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

bool configure(GstQdmdBackground* self, const Settings& settings, const GstVideoInfo& info) {
  Frames* frames = self->frames;
  frames->shells.clear();
  frames->solves_told = 0;
  frames->next_pts = GST_CLOCK_TIME_NONE;
  return guarded(self, [&] {
    return frames->engine.configure(settings.engine, GST_VIDEO_INFO_WIDTH(&info),
                                    GST_VIDEO_INFO_HEIGHT(&info));
  });
}

GstFlowReturn prepare_for(GstQdmdBackground* self, GstBuffer* input) {
  follow_controllers(self, input);
  GST_OBJECT_LOCK(self);
  const bool reset = std::exchange(self->frames->reset_asked, false);
  GST_OBJECT_UNLOCK(self);
  const bool jump = time_jumps(self, input);
  if (jump) GST_DEBUG_OBJECT(self, "time jumps: a new window begins");
  // The base class keeps is_discont set until something was pushed, which can be a window later:
  // the buffer's own flag says where time breaks.
  if (GST_BUFFER_IS_DISCONT(input) || jump || reset) {
    const GstFlowReturn flow = drain(self);
    if (flow != GST_FLOW_OK) return flow;
  }
  if (reset) drop_frames(self);
  return GST_FLOW_OK;
}

GstFlowReturn take_frame(GstQdmdBackground* self, BufferPtr buffer) {
  Frames* frames = self->frames;
  // The base class asks for frames until there is none, or until downstream refuses one (it has
  // ended, or is not linked); upstream may go on all the same. Nobody wants what is left.
  if (frames->engine.ready()) drop_frames(self);

  GST_OBJECT_LOCK(self);
  const bool freeze = frames->settings.freeze;
  const int threads = frames->settings.engine.threads;
  const double budget = frames->settings.time_budget;
  GST_OBJECT_UNLOCK(self);
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
      frames->shells.push_back(std::move(shell));
      frames->engine.set_freeze(freeze);
      frames->engine.set_threads(threads);
      frames->engine.set_time_budget(budget / 1000);
      double conversion = 0;
      const ImageView view = [&] {
        const Stopwatch watch(&conversion);
        return frames->io.read(frame);
      }();
      const Status status = frames->engine.push(view);
      frames->engine.add_time(conversion);
      return status;
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

}  // namespace qdmd
