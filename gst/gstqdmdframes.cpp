#include "gst/gstqdmdframes.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
#include <optional>
#include <utility>

#include "gst/gstqdmdareas.h"
#include "gst/gstqdmdenums.h"
#include "gst/gstqdmdlearnt.h"
#include "gst/videoformat.h"
#include "gst/videoview.h"

GST_DEBUG_CATEGORY_EXTERN(qdmd_background_debug);
#define GST_CAT_DEFAULT qdmd_background_debug

namespace qdmd {
namespace {

// A gap between two frames beyond which time is broken; cameras may lose some frames.
constexpr GstClockTime kMostGap = GST_SECOND;
constexpr int kMostGapFrames = 5;

}  // namespace

// Posts what a refused engine call said. Called without locks.
static void post_status(GstElement* self, const Status& status) {
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

// Runs `action` (returning Status) with the engine lock; true if it succeeded, else an error is
// posted. No exception gets past this.
template <typename Action>
static bool with_engine(GstElement* self, Action action) {
  Status status;
  bool no_memory = false;
  gchar* what = nullptr;
  try {
    const std::lock_guard lock(state_of(self)->engine_lock);
    status = action(state_of(self)->engine);
  } catch (const std::bad_alloc&) {
    no_memory = true;
  } catch (const std::exception& error) {
    what = g_strdup(error.what());
  }
  if (no_memory) {
    GST_ELEMENT_ERROR(self, RESOURCE, NO_SPACE_LEFT,
                      ("Not enough memory for the window: lower window-size or scale the video "
                       "down."),
                      (nullptr));
    return false;
  }
  if (what) {
    GST_ELEMENT_ERROR(self, LIBRARY, FAILED, (nullptr), ("%s", what));
    g_free(what);
    return false;
  }
  if (status.ok()) return true;
  post_status(self, status);
  return false;
}

// Forgets what waits, and where time is.
static void forget_frames(GstElement* self) {
  State* state = state_of(self);
  state->shells.clear();
  // What is true of the stream stays true.
  while (EventPtr event = state->shells.next_event())
    if (GST_EVENT_IS_STICKY(event.get())) state->keep(std::move(event));
  GST_OBJECT_LOCK(self);
  state->latency.restart();
  GST_OBJECT_UNLOCK(self);
  state->next_pts = GST_CLOCK_TIME_NONE;
}

void drop_frames(GstElement* self) {
  State* state = state_of(self);
  const std::lock_guard lock(state->engine_lock);
  state->background.keep(state->engine);
  state->engine.flush();
  forget_frames(self);
}

void close(GstElement* self) {
  drop_frames(self);
  State* state = state_of(self);
  state->mask = {};
  state->residual = {};
  state->regions = {};
  const std::lock_guard lock(state->engine_lock);
  state->engine.close();
}

// The time of the frames that leave with the newest solve: `leaving`, if there is one, and those of
// them that wait.
struct FrameTime {
  GstClockTime timestamp = GST_CLOCK_TIME_NONE, duration = GST_CLOCK_TIME_NONE;
};
static FrameTime time_of_solve(const State& state, GstBuffer* leaving) {
  FrameTime time;
  const auto waiting =
      std::min(static_cast<size_t>(state.engine.frames_left()), state.shells.size());
  GstBuffer* first = leaving ? leaving : waiting > 0 ? state.shells.at(0) : nullptr;
  if (!first) return time;
  GstBuffer* last = waiting > 0 ? state.shells.at(waiting - 1) : first;
  time.timestamp = GST_BUFFER_PTS(first);
  if (GST_BUFFER_PTS_IS_VALID(first) && GST_BUFFER_PTS_IS_VALID(last) &&
      GST_BUFFER_PTS(last) >= time.timestamp)
    time.duration = GST_BUFFER_PTS(last) - time.timestamp +
                    (GST_BUFFER_DURATION_IS_VALID(last) ? GST_BUFFER_DURATION(last) : 0);
  return time;
}

// Backgrounds that came into use, and what was found of the newest one.
struct NewSolves {
  guint64 count = 0;
  SolveReport report;
  FrameTime time;
};

// After `frames_in` frames went into the engine and `frames_out` came out, with the engine lock,
// since another thread may load a background: copies what others may want to know of the engine.
// The background property's picture and its time belong together.
static NewSolves publish(GstElement* self, guint64 frames_in, guint64 frames_out,
                         GstBuffer* leaving) {
  State* state = state_of(self);
  const Engine& engine = state->engine;
  NewSolves solves;
  solves.count = engine.solves() - state->solves_told;
  state->solves_told += solves.count;
  if (solves.count > 0) {
    solves.report = engine.report();
    solves.time = time_of_solve(*state, leaving);
    state->background.solved(*state->segment, solves.time.timestamp, solves.time.duration);
  }
  GST_OBJECT_LOCK(self);
  state->counters.frames_in += frames_in;
  state->counters.frames_out += frames_out;
  state->counters.solves += solves.count;
  state->counters.solve_period = guint(engine.time_budget().effort().period);
  state->counters.time_per_frame = 1000 * engine.time_budget().predicted();
  state->counters.camera = engine.newest_pose();
  state->report = engine.report();
  GST_OBJECT_UNLOCK(self);
  return solves;
}

// Says what new solves found.
static void tell_of_solves(GstElement* self, const NewSolves& solves) {
  if (solves.count == 0) return;
  State* state = state_of(self);
  GST_OBJECT_LOCK(self);
  const bool post = state->settings.post_messages;
  const Counters counters = state->counters;
  GST_OBJECT_UNLOCK(self);
  if (!post) return;
  gst_element_post_message(
      self, gst_message_new_element(
                GST_OBJECT(self), make_solve_message(solves.report, counters, *state->segment,
                                                     solves.time.timestamp, solves.time.duration)));
}

// Says that the frame of that time, or one a few frames before it, began another scene.
static void tell_of_scene(GstElement* self, GstClockTime timestamp) {
  State* state = state_of(self);
  const guint64 scenes = state->engine.scenes(), views = state->engine.views();
  if (scenes > state->scenes_told) {
    GST_INFO_OBJECT(self, "another scene: learning begins anew");
    gst_element_post_message(
        self,
        gst_message_new_element(GST_OBJECT(self), make_scene_message(*state->segment, timestamp,
                                                                     views > state->views_told)));
  }
  // An engine that is configured anew counts anew.
  state->scenes_told = scenes;
  state->views_told = views;
}

// Says where the camera looked in a frame that leaves, as long as it moves.
static void tell_of_camera(GstElement* self, const Pose& pose, GstClockTime timestamp) {
  State* state = state_of(self);
  const bool moves = !pose.is_rest() || state->camera_moved;
  state->camera_moved = !pose.is_rest();
  if (!moves) return;
  GST_OBJECT_LOCK(self);
  const bool post = state->settings.post_messages;
  GST_OBJECT_UNLOCK(self);
  if (!post) return;
  gst_element_post_message(
      self, gst_message_new_element(GST_OBJECT(self),
                                    make_camera_message(*state->segment, timestamp, pose)));
}

// Says once that frames cannot be moved.
static void warn_of_no_room(GstElement* self) {
  State* state = state_of(self);
  if (!state->engine.has_no_room_for_motion() || std::exchange(state->warned_of_no_room, true))
    return;
  GST_ELEMENT_WARNING(
      self, RESOURCE, NO_SPACE_LEFT,
      ("The camera moves. To follow it, stabilize needs a second copy of the window, and "
       "max-memory "
       "has no room for it, so frames are not stabilized. Raise max-memory, lower window-size, or "
       "set stabilize=off."),
      (nullptr));
}

// Sets controlled properties to what they are at the time of `buffer`.
static void follow_controllers(GstElement* self, GstBuffer* buffer) {
  const GstSegment& segment = *state_of(self)->segment;
  if (segment.format != GST_FORMAT_TIME || !GST_BUFFER_PTS_IS_VALID(buffer)) return;
  const guint64 time =
      gst_segment_to_stream_time(&segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  if (GST_CLOCK_TIME_IS_VALID(time)) gst_object_sync_values(GST_OBJECT(self), time);
}

// Where nothing is foreground in the frame of this buffer.
static IgnoredAreas ignored_of(const Settings& settings, GstBuffer* buffer) {
  IgnoredAreas areas = settings.ignored;
  add_regions_of(buffer, settings.ignored_type, &areas);
  return areas;
}

// Regions of the frame that comes out next.
static const std::vector<Region>& next_regions(GstElement* self, int least_area) {
  State* state = state_of(self);
  const GstVideoInfo* info = &state->info;
  const int width = GST_VIDEO_INFO_WIDTH(info), height = GST_VIDEO_INFO_HEIGHT(info);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  state->mask.resize(pixels);
  state->residual.resize(pixels);
  state->engine.foreground(state->mask.data(), state->residual.data());
  return state->regions.find(state->mask.data(), state->residual.data(), width, height, least_area);
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

void send_events(GstElement* self) {
  State* state = state_of(self);
  while (EventPtr event = state->shells.next_event()) state->forward(std::move(event));
}

bool hold_event(GstElement* self, GstEvent* event) {
  if (!GST_EVENT_IS_SERIALIZED(event) || GST_EVENT_TYPE(event) == GST_EVENT_CAPS) return false;
  // Where downstream refused the last frame, nobody has come for them.
  send_events(self);
  return state_of(self)->shells.hold(event);
}

GstFlowReturn next_pictures(GstElement* self, OutputPictures* pictures) {
  State* state = state_of(self);
  pictures->clear();
  send_events(self);
  if (!state->engine.ready()) return GST_FLOW_OK;

  const BufferPtr shell = state->shells.pop();
  follow_controllers(self, shell.get());
  GST_OBJECT_LOCK(self);
  const Settings settings = state->settings;
  GST_OBJECT_UNLOCK(self);

  const GstFlowReturn flow = state->make_pictures(shell.get(), settings, pictures);
  if (flow != GST_FLOW_OK) {
    // Its frame is still in the engine, and nobody wants it.
    drop_frames(self);
    return flow;
  }
  const std::vector<Region>* regions = nullptr;
  Pose pose;
  NewSolves solves;
  {
    std::optional<MappedVideoFrame> frames[OutputPictures::kMost];
    size_t mapped = 0;
    for (const OutputPicture& picture : *pictures) {
      auto& frame = frames[mapped++];
      frame.emplace(picture.info, picture.buffer.get(), GST_MAP_WRITE);
      if (*frame) continue;
      GST_ELEMENT_ERROR(self, RESOURCE, WRITE, (nullptr), ("could not map an output buffer"));
      drop_frames(self);
      return GST_FLOW_ERROR;
    }
    const bool written = with_engine(self, [&](Engine& engine) {
      const Clock::Span span(engine.clock(), Clock::frames);
      engine.set_foreground_threshold(settings.engine.foreground_threshold);
      engine.set_shadows(settings.shadows);
      engine.set_mask_softness(settings.engine.mask_softness);
      engine.set_stabilize_output(settings.stabilize_output);
      engine.set_ignored(ignored_of(settings, shell.get()));
      pose = engine.next_pose();
      if (settings.regions && mapped > 0) regions = &next_regions(self, settings.regions_min_area);
      size_t next = 0;
      for (const OutputPicture& picture : *pictures)
        engine.write(picture.output, levels_of(*picture.info), frames[next++]->view<uint8_t>());
      engine.skip();
      solves = publish(self, 0, 1, shell.get());
      return Status();
    });
    if (!written) {
      drop_frames(self);
      return GST_FLOW_ERROR;
    }
  }
  if (regions)
    for (const OutputPicture& picture : *pictures) attach(picture.buffer.get(), *regions);
  tell_of_solves(self, solves);
  tell_of_camera(self, pose, GST_BUFFER_PTS(shell.get()));
  return GST_FLOW_OK;
}

GstFlowReturn drain(GstElement* self) {
  State* state = state_of(self);
  if (!state->engine.configured()) return GST_FLOW_OK;
  GST_DEBUG_OBJECT(self, "draining %u frames", guint(state->shells.size()));
  GstFlowReturn flow = GST_FLOW_OK;
  NewSolves solves;
  const auto solve = [&](Engine& engine) {
    Status status = engine.drain();
    if (status.ok()) solves = publish(self, 0, 0, nullptr);
    return status;
  };
  if (!with_engine(self, solve)) {
    drop_frames(self);
    return GST_FLOW_ERROR;
  }
  tell_of_solves(self, solves);
  while (state->goes_on(flow) && state->engine.ready()) {
    OutputPictures pictures;
    flow = next_pictures(self, &pictures);
    if (flow == GST_FLOW_OK) flow = state->send(&pictures);
  }
  send_events(self);
  GST_OBJECT_LOCK(self);
  state->latency.restart();
  GST_OBJECT_UNLOCK(self);
  if (state->goes_on(flow)) return flow;
  GST_DEBUG_OBJECT(self, "dropped %u frames: %s", guint(state->shells.size()),
                   gst_flow_get_name(flow));
  drop_frames(self);
  return flow;
}

enum class Step {
  onwards,    // as far as anybody knows
  backwards,  // the frame that ends where the one before it began: reverse playback
  jump        // back, or on by more than a camera loses
};
// From the frame before to `input`. Notes where the next frame is expected.
static Step step_to(GstElement* self, GstBuffer* input) {
  State* state = state_of(self);
  GstClockTime* next = &state->next_pts;
  const GstVideoInfo* info = &state->info;
  const GstClockTime expected = *next, pts = GST_BUFFER_PTS(input);
  const bool has_rate = GST_VIDEO_INFO_FPS_N(info) > 0;
  GstClockTime frame = GST_BUFFER_DURATION(input);
  if (has_rate)
    frame = gst_util_uint64_scale(GST_SECOND, guint64(GST_VIDEO_INFO_FPS_D(info)),
                                  guint64(GST_VIDEO_INFO_FPS_N(info)));
  *next = GST_CLOCK_TIME_NONE;
  if (!GST_CLOCK_TIME_IS_VALID(pts)) return Step::onwards;
  if (!GST_CLOCK_TIME_IS_VALID(frame)) frame = 0;
  if (state->segment->rate < 0) {
    // Frames come in reverse order.
    *next = pts;
    const bool meets = GST_CLOCK_TIME_IS_VALID(expected) &&
                       ABS(GST_CLOCK_DIFF(expected, pts + frame)) <= GstClockTimeDiff(frame / 2);
    return meets ? Step::backwards : Step::onwards;
  }
  *next = pts + frame;
  if (!GST_CLOCK_TIME_IS_VALID(expected)) return Step::onwards;
  // Rounded timestamps may fall short by some.
  if (pts + MAX(frame, 10 * GST_MSECOND) < expected) return Step::jump;
  // Without a rate nobody knows how long a frame lasts.
  const bool gap = has_rate && pts > expected + MAX(kMostGap, kMostGapFrames * frame);
  return gap ? Step::jump : Step::onwards;
}

// Warns once of each property that was set and has no effect with this method.
static void warn_of_settings_without_effect(GstElement* self, const Settings& settings) {
  for (const char* name : options_without_effect(settings.engine.method)) {
    const guint id = g_object_class_find_property(G_OBJECT_GET_CLASS(self), name)->param_id;
    const guint bit = 1u << id;
    if (!(settings.asked & bit) || (state_of(self)->warned & bit)) continue;
    state_of(self)->warned |= bit;
    GST_WARNING_OBJECT(self, "method=%s does not look at %s: it has no effect",
                       method_name(settings.engine.method), name);
  }
}

// Frames that stand alone make no window: says so once.
static void warn_of_breaks(GstElement* self, bool jump) {
  State* state = state_of(self);
  constexpr guint kMany = 3;
  state->breaks = jump ? state->breaks + 1 : 0;
  if (state->breaks < kMany || std::exchange(state->warned_of_breaks, true)) return;
  GST_ELEMENT_WARNING(
      self, STREAM, FORMAT,
      ("Frames are too far apart in time to form a window, so each frame is its own background. A "
       "gap of more than one second and more than %d frames begins a new window: set the true "
       "framerate, for instance with videorate.",
       kMostGapFrames),
      (nullptr));
}

bool configure(GstElement* self, const Settings& settings, const GstVideoInfo& info,
               GstCaps* caps) {
  State* state = state_of(self);
  warn_of_settings_without_effect(self, settings);
  forget_frames(self);
  state->info = info;
  state->solves_told = 0;
  EngineOptions options = settings.engine;
  set_format(info, &options);
  options.frame_rate = GST_VIDEO_INFO_FPS_N(&info) > 0 && GST_VIDEO_INFO_FPS_D(&info) > 0
                           ? double(GST_VIDEO_INFO_FPS_N(&info)) / GST_VIDEO_INFO_FPS_D(&info)
                           : Latency::kAssumedRate;
  const bool configured = with_engine(self, [&](Engine& engine) {
    state->background.keep(engine);
    state->background.set_caps(info, CapsPtr(gst_caps_ref(caps)));
    Status status =
        engine.configure(options, GST_VIDEO_INFO_WIDTH(&info), GST_VIDEO_INFO_HEIGHT(&info));
    state->colours = options.colours;
    if (status.ok())
      state->shells.reserve(static_cast<size_t>(engine.delay()) + 1);
    else
      engine.flush();
    return status;
  });
  return configured && apply_loaded(self);
}

GstFlowReturn prepare_for(GstElement* self, GstBuffer* input) {
  follow_controllers(self, input);
  GST_OBJECT_LOCK(self);
  const bool reset = std::exchange(state_of(self)->reset_asked, false);
  GST_OBJECT_UNLOCK(self);
  const Step step = step_to(self, input);
  const bool jump = step == Step::jump;
  if (jump) GST_DEBUG_OBJECT(self, "time jumps: a new window begins");
  warn_of_breaks(self, jump);
  // The base class keeps is_discont set until something was pushed, which can be a window later:
  // the buffer's own flag says where time breaks.
  // GstBaseSrc sets it on every buffer of reverse playback, whatever was before.
  const bool discont = GST_BUFFER_IS_DISCONT(input) && step != Step::backwards;
  if (discont || jump || reset) {
    const GstFlowReturn flow = drain(self);
    if (!state_of(self)->goes_on(flow)) return flow;
  }
  if (reset) {
    drop_frames(self);
    // Loaded after the reset was asked for.
    if (!apply_loaded(self)) return GST_FLOW_ERROR;
  }
  return GST_FLOW_OK;
}

// Of the clock that sinks go by; before there is one, of the system's.
static GstClockTime time_now(GstElement* self) {
  ClockPtr clock(gst_element_get_clock(self));
  if (!clock) clock.reset(gst_system_clock_obtain());
  return gst_clock_get_time(clock.get());
}

// After a frame that came at the time `came`: whether the next to leave waits longer than sinks
// were told.
static void follow_latency(GstElement* self, GstClockTime timestamp, GstClockTime came) {
  State* state = state_of(self);
  const GstClockTime now = state->engine.held_up() ? time_now(self) : came,
                     held = now > came ? now - came : 0;
  GST_OBJECT_LOCK(self);
  bool grew = state->latency.frame_in(timestamp);
  grew |= state->latency.held_up(held);
  if (state->engine.ready())
    grew |= state->latency.frame_out(GST_BUFFER_PTS(state->shells.at(0)), held);
  const GstClockTime latency = state->latency.promised();
  GST_OBJECT_UNLOCK(self);
  if (!grew) return;
  GST_INFO_OBJECT(self, "latency is %" GST_TIME_FORMAT " by now", GST_TIME_ARGS(latency));
  gst_element_post_message(self, gst_message_new_latency(GST_OBJECT(self)));
}

// Of the frames as they come; 0: never.
static gint64 absorb_frames(GstElement* self, double seconds) {
  if (seconds <= 0) return 0;
  State* state = state_of(self);
  const GstVideoInfo* info = &state->info;
  const double rate = state->latency.rate(GST_VIDEO_INFO_FPS_N(info), GST_VIDEO_INFO_FPS_D(info));
  return gint64(std::clamp(std::round(seconds * rate), 1.0, 1e12));
}

// Metadata that is nothing but a hold on upstream's buffer.
static gboolean leave_parent(GstBuffer*, GstMeta** meta, gpointer) {
  if ((*meta)->info->api == GST_PARENT_BUFFER_META_API_TYPE) *meta = nullptr;
  return TRUE;
}

GstFlowReturn take_frame(GstElement* self, BufferPtr buffer) {
  State* state = state_of(self);
  // The base class asks for frames until there is none, or until downstream refuses one (it has
  // ended, or is not linked); upstream may go on all the same. Nobody wants what is left.
  if (state->engine.ready()) drop_frames(self);

  const GstClockTime came = time_now(self);
  GST_OBJECT_LOCK(self);
  const Settings settings = state->settings;
  GST_OBJECT_UNLOCK(self);
  const bool masks = settings.regions || state->wants_masks(settings);
  BufferPtr shell(gst_buffer_new());
  gst_buffer_copy_into(
      shell.get(), buffer.get(),
      GstBufferCopyFlags(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS | GST_BUFFER_COPY_META),
      0, gsize(-1));
  gst_buffer_foreach_meta(shell.get(), leave_parent, nullptr);
  NewSolves solves;
  {
    const MappedVideoFrame frame(&state->info, buffer.get(), GST_MAP_READ);
    if (!frame) {
      GST_ELEMENT_ERROR(self, STREAM, FORMAT,
                        ("A buffer does not hold a frame of the negotiated caps."), (nullptr));
      return GST_FLOW_ERROR;
    }
    const bool taken = with_engine(self, [&](Engine& engine) {
      const Clock::Span span(engine.clock(), Clock::frames);
      state->shells.push(std::move(shell));
      engine.set_freeze(settings.freeze);
      engine.set_threads(settings.engine.threads);
      engine.set_time_budget(settings.time_budget / 1000);
      engine.set_masks_expected(masks);
      engine.set_absorb_frames(absorb_frames(self, settings.absorb_time));
      engine.set_ignored(ignored_of(settings, buffer.get()));
      Status status = engine.push(frame.view<const uint8_t>());
      if (status.ok()) solves = publish(self, 1, 0, nullptr);
      return status;
    });
    if (!taken) {
      drop_frames(self);
      return GST_FLOW_ERROR;
    }
  }
  tell_of_scene(self, GST_BUFFER_PTS(buffer.get()));
  warn_of_no_room(self);
  tell_of_solves(self, solves);
  follow_latency(self, GST_BUFFER_PTS(buffer.get()), came);
  return GST_FLOW_OK;
}

}  // namespace qdmd
