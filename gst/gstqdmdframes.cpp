// SPDX-License-Identifier: LGPL-2.1-or-later
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

// Posts what a refused engine call said. Called without locks.
static void post_status(GstElement* self, const Status& status) {
  switch (status.code) {
    case Status::Code::too_much_memory:
      GST_ELEMENT_ERROR(self, RESOURCE, NO_SPACE_LEFT, ("%s", status.message.c_str()), (nullptr));
      break;
    case Status::Code::bad_folder:
      GST_ELEMENT_ERROR(self, RESOURCE, OPEN_READ_WRITE, ("%s", status.message.c_str()), (nullptr));
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
static bool with_engine(State& state, Action action) {
  Status status;
  bool no_memory = false;
  gchar* what = nullptr;
  try {
    const std::lock_guard lock(state.engine_lock);
    status = action(state.engine);
  } catch (const std::bad_alloc&) {
    no_memory = true;
  } catch (const std::exception& error) {
    what = g_strdup(error.what());
  }
  if (no_memory) {
    GST_ELEMENT_ERROR(state.element, RESOURCE, NO_SPACE_LEFT,
                      ("Not enough memory for the window: lower window-size or scale the video "
                       "down."),
                      (nullptr));
    return false;
  }
  if (what) {
    GST_ELEMENT_ERROR(state.element, LIBRARY, FAILED, (nullptr), ("%s", what));
    g_free(what);
    return false;
  }
  if (status.ok()) return true;
  post_status(state.element, status);
  return false;
}

// Forgets what waits, and where time is.
static void forget_frames(State& state) {
  state.shells.clear();
  // What is true of the stream stays true.
  while (EventPtr event = state.shells.next_event())
    if (GST_EVENT_IS_STICKY(event.get())) state.keep(std::move(event));
  GST_OBJECT_LOCK(state.element);
  state.latency.restart();
  GST_OBJECT_UNLOCK(state.element);
  state.time.forget();
}

void drop_frames(State& state) {
  {
    const std::lock_guard lock(state.engine_lock);
    state.background.keep(state.engine);
    state.engine.flush();
    forget_frames(state);
  }
  state.objects.cut_off(state.element);
}

void close(State& state) {
  drop_frames(state);
  state.objects.close();
  GST_OBJECT_LOCK(state.element);
  state.configure_asked = true;
  GST_OBJECT_UNLOCK(state.element);
  const std::lock_guard lock(state.engine_lock);
  state.engine.close();
}

// The time of the frames that leave with the newest solve: `leaving`, if there is one, and those of
// them that wait.
struct FrameTime {
  GstClockTime timestamp = GST_CLOCK_TIME_NONE, duration = GST_CLOCK_TIME_NONE;
};
static FrameTime time_of_solve(const State& state, int frames_left, GstBuffer* leaving) {
  FrameTime time;
  const auto waiting = std::min(static_cast<size_t>(frames_left), state.shells.size());
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

// How the engine stands, and the backgrounds that came into use since the last look.
struct News {
  EngineReport engine;
  guint64 solves = 0;
  FrameTime time;  // of the newest one's frames
};

// After `frames_in` frames went into the engine and `frames_out` came out, with the engine lock,
// since another thread may load a background: copies what others may want to know of the engine.
// The background property's picture and its time belong together.
static News publish(State& state, guint64 frames_in, guint64 frames_out, GstBuffer* leaving) {
  News news = {state.engine.report(), 0, {}};
  news.solves = news.engine.solves - state.solves_told;
  state.solves_told += news.solves;
  if (news.solves > 0) {
    news.time = time_of_solve(state, news.engine.frames_left, leaving);
    state.background.solved(*state.segment, news.time.timestamp, news.time.duration);
  }
  GST_OBJECT_LOCK(state.element);
  state.counters.frames_in += frames_in;
  state.counters.frames_out += frames_out;
  state.counters.solves += news.solves;
  state.counters.solve_period = guint(news.engine.effort.period);
  state.counters.time_per_frame = 1000 * news.engine.costs.predicted(news.engine.effort);
  state.counters.camera = news.engine.newest_pose;
  state.report = news.engine.solve;
  GST_OBJECT_UNLOCK(state.element);
  return news;
}

// Says what new solves found.
static void tell_of_solves(State& state, const News& news) {
  if (news.solves == 0) return;
  const bool settled = news.engine.solve.settled;
  if (settled && !state.told_ready)
    gst_element_post_message(
        state.element,
        gst_message_new_element(GST_OBJECT(state.element),
                                make_ready_message(*state.segment, news.time.timestamp)));
  state.told_ready = settled;
  GST_OBJECT_LOCK(state.element);
  const bool post = state.settings.post_messages;
  const Counters counters = state.counters;
  GST_OBJECT_UNLOCK(state.element);
  if (!post) return;
  gst_element_post_message(
      state.element,
      gst_message_new_element(GST_OBJECT(state.element),
                              make_solve_message(news.engine.solve, counters, *state.segment,
                                                 news.time.timestamp, news.time.duration)));
}

// Says that the frame of that time, or one a few frames before it, began another scene.
static void tell_of_scene(State& state, const EngineReport& engine, GstClockTime timestamp) {
  if (engine.scenes > state.scenes_told) {
    GST_INFO_OBJECT(state.element, "another scene: learning begins anew");
    gst_element_post_message(
        state.element,
        gst_message_new_element(
            GST_OBJECT(state.element),
            make_scene_message(*state.segment, timestamp, engine.views > state.views_told)));
  }
  // An engine that is configured anew counts anew.
  state.scenes_told = engine.scenes;
  state.views_told = engine.views;
}

// Says where the camera looked in a frame that leaves, as long as it moves.
static void tell_of_camera(State& state, const Pose& pose, GstClockTime timestamp) {
  const bool moves = !pose.is_rest() || state.camera_moved;
  state.camera_moved = !pose.is_rest();
  if (!moves) return;
  GST_OBJECT_LOCK(state.element);
  const bool post = state.settings.post_messages;
  GST_OBJECT_UNLOCK(state.element);
  if (!post) return;
  gst_element_post_message(
      state.element, gst_message_new_element(GST_OBJECT(state.element),
                                             make_camera_message(*state.segment, timestamp, pose)));
}

// Says once that frames cannot be moved.
static void warn_of_no_room(State& state, const EngineReport& engine) {
  if (!engine.no_room_for_motion || std::exchange(state.warned_of_no_room, true)) return;
  GST_ELEMENT_WARNING(
      state.element, RESOURCE, NO_SPACE_LEFT,
      ("The camera moves. To follow it, stabilize needs a second copy of the window, and "
       "max-memory "
       "has no room for it, so frames are not stabilized. Raise max-memory, lower window-size, or "
       "set stabilize=off."),
      (nullptr));
}

// Warns of rectangles that no pixel of the video is in, or all of them are, once each time that
// they are set.
static void warn_of_areas(State& state, const Settings& settings) {
  if (std::exchange(state.ignored_seen, settings.ignored_set) == settings.ignored_set) return;
  const int width = GST_VIDEO_INFO_WIDTH(&state.info), height = GST_VIDEO_INFO_HEIGHT(&state.info);
  if (settings.wishes.ignored.cover(width, height))
    GST_ELEMENT_WARNING(state.element, LIBRARY, SETTINGS,
                        ("ignore covers the whole picture, which is %dx%d: nothing will ever be "
                         "foreground. Make its rectangles smaller.",
                         width, height),
                        (nullptr));
  const guint outside = settings.wishes.ignored.outside(width, height);
  if (outside == 0) return;
  GST_ELEMENT_WARNING(
      state.element, LIBRARY, SETTINGS,
      ("ignore has %u %s outside of the picture, which is %dx%d: there is nothing to "
       "leave out. A rectangle is <x, y, width, height> in pixels of the video "
       "that comes in.",
       outside, outside == 1 ? "rectangle" : "rectangles", width, height),
      (nullptr));
}

// Warns once of a picture that has fewer pixels than its size says.
static void warn_of_scale(State& state, Output output) {
  if (!state.reduces || output == Output::mask) return;
  state.reduces = false;
  GST_ELEMENT_WARNING(
      state.element, LIBRARY, SETTINGS,
      ("Only masks were wanted when this video began, so less of each frame is kept: other "
       "pictures are enlarged. Set mask-scale=1 before you start the element."),
      (nullptr));
}

// Sets controlled properties to what they are at the time of `buffer`.
static void follow_controllers(State& state, GstBuffer* buffer) {
  const GstSegment& segment = *state.segment;
  if (segment.format != GST_FORMAT_TIME || !GST_BUFFER_PTS_IS_VALID(buffer)) return;
  const guint64 time =
      gst_segment_to_stream_time(&segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  if (GST_CLOCK_TIME_IS_VALID(time)) gst_object_sync_values(GST_OBJECT(state.element), time);
}

// What is wished of the frame of this buffer.
static Wishes wishes_of(const Settings& settings, GstBuffer* buffer) {
  Wishes wishes = settings.wishes;
  add_regions_of(buffer, settings.ignored_type, &wishes.ignored);
  return wishes;
}

// Somebody wants to know of regions, or of what becomes of things.
static bool wants_objects(const Settings& settings) {
  return settings.regions || settings.object_messages;
}

void send_events(State& state) {
  while (EventPtr event = state.shells.next_event()) state.forward(std::move(event));
}

bool hold_event(State& state, GstEvent* event) {
  if (!GST_EVENT_IS_SERIALIZED(event) || GST_EVENT_TYPE(event) == GST_EVENT_CAPS) return false;
  // Where downstream refused the last frame, nobody has come for them.
  send_events(state);
  return state.shells.hold(event);
}

GstFlowReturn next_pictures(State& state, OutputPictures* pictures) {
  pictures->clear();
  send_events(state);
  if (!state.engine.next()) return GST_FLOW_OK;

  const BufferPtr shell = state.shells.pop();
  follow_controllers(state, shell.get());
  GST_OBJECT_LOCK(state.element);
  const Settings settings = state.settings;
  GST_OBJECT_UNLOCK(state.element);

  const GstFlowReturn flow = state.make_pictures(shell.get(), settings, pictures);
  for (const OutputPicture& picture : *pictures) warn_of_scale(state, picture.output);
  if (flow != GST_FLOW_OK) {
    // Nobody wants what is still in the engine.
    drop_frames(state);
    return flow;
  }
  // Who has no picture still hears of things.
  const bool objects = settings.object_messages || (settings.regions && !pictures->empty());
  if (!objects) state.objects.cut_off(state.element);
  Pose pose;
  News news;
  {
    std::optional<MappedVideoFrame> frames[OutputPictures::kMost];
    size_t mapped = 0;
    for (const OutputPicture& picture : *pictures) {
      auto& frame = frames[mapped++];
      frame.emplace(picture.info, picture.buffer.get(), GST_MAP_WRITE);
      if (*frame) continue;
      GST_ELEMENT_ERROR(state.element, RESOURCE, WRITE, (nullptr),
                        ("could not map an output buffer"));
      drop_frames(state);
      return GST_FLOW_ERROR;
    }
    const bool written = with_engine(state, [&](Engine& engine) {
      const Clock::Span span(engine.clock(), Clock::frames);
      const Wishes wishes = wishes_of(settings, shell.get());
      LeavingFrame* const frame = engine.next(&wishes);
      pose = frame->pose();
      if (objects) state.objects.look(frame, settings, *state.segment, GST_BUFFER_PTS(shell.get()));
      size_t next = 0;
      for (const OutputPicture& picture : *pictures)
        frame->write(picture.output, levels_of(*picture.info), frames[next++]->view<uint8_t>());
      frame->skip();
      news = publish(state, 0, 1, shell.get());
      return Status();
    });
    if (!written) {
      drop_frames(state);
      return GST_FLOW_ERROR;
    }
  }
  if (objects) {
    for (const OutputPicture& picture : *pictures) state.objects.attach(picture.buffer.get());
    state.objects.tell(state.element, state.info);
  }
  tell_of_solves(state, news);
  tell_of_camera(state, pose, GST_BUFFER_PTS(shell.get()));
  return GST_FLOW_OK;
}

GstFlowReturn drain(State& state) {
  if (!state.engine.configured()) return GST_FLOW_OK;
  GST_DEBUG_OBJECT(state.element, "draining %u frames", guint(state.shells.size()));
  GstFlowReturn flow = GST_FLOW_OK;
  News news;
  const auto solve = [&](Engine& engine) {
    Status status = engine.drain();
    if (status.ok()) news = publish(state, 0, 0, nullptr);
    return status;
  };
  if (!with_engine(state, solve)) {
    drop_frames(state);
    return GST_FLOW_ERROR;
  }
  tell_of_solves(state, news);
  while (state.goes_on(flow) && state.engine.next()) {
    OutputPictures pictures;
    flow = next_pictures(state, &pictures);
    if (flow == GST_FLOW_OK) flow = state.send(&pictures);
  }
  send_events(state);
  GST_OBJECT_LOCK(state.element);
  state.latency.restart();
  GST_OBJECT_UNLOCK(state.element);
  if (state.goes_on(flow)) return flow;
  GST_DEBUG_OBJECT(state.element, "dropped %u frames: %s", guint(state.shells.size()),
                   gst_flow_get_name(flow));
  drop_frames(state);
  return flow;
}

GstFlowReturn send_waiting(State& state) {
  if (state.shells.empty()) return GST_FLOW_OK;
  const GstFlowReturn flow = drain(state);
  const std::lock_guard lock(state.engine_lock);
  state.engine.go_on();
  return flow;
}

GstFlowReturn send_ready(State& state) {
  GstFlowReturn flow = GST_FLOW_OK;
  while (flow == GST_FLOW_OK && state.engine.next()) {
    OutputPictures pictures;
    flow = next_pictures(state, &pictures);
    if (flow == GST_FLOW_OK) flow = state.send(&pictures);
  }
  if (flow == GST_FLOW_OK) send_events(state);
  return flow;
}

// Warns once of each property that was set and has no effect with this method.
static void warn_of_settings_without_effect(State& state, const Settings& settings) {
  for (const char* name : options_without_effect(settings.engine.method)) {
    const guint id =
        g_object_class_find_property(G_OBJECT_GET_CLASS(state.element), name)->param_id;
    if (!settings.asked[id] || state.warned[id]) continue;
    state.warned.set(id);
    GST_WARNING_OBJECT(state.element, "method=%s does not look at %s: it has no effect",
                       method_name(settings.engine.method), name);
  }
}

// The scale of masks, where that is for the element to choose: other pictures lose what masks do
// not.
static int mask_scale_of(const State& state, const Settings& settings, const GstVideoInfo& info) {
  if (settings.mask_scale != 0) return settings.mask_scale;
  const bool pictures = settings.object_messages && settings.object_snapshots;
  if (pictures || !state.wants_masks_alone(settings)) return 1;
  const int width = GST_VIDEO_INFO_WIDTH(&info), height = GST_VIDEO_INFO_HEIGHT(&info);
  return Reduction::automatic_scale(width, height);
}

bool configure(State& state, const Settings& settings, const GstVideoInfo& info, GstCaps* caps) {
  warn_of_settings_without_effect(state, settings);
  forget_frames(state);
  state.objects.cut_off(state.element);
  state.objects.begin(info, settings.engine.mode == Mode::live);
  state.info = info;
  state.solves_told = 0;
  state.told_ready = false;
  state.ignored_seen = 0;
  EngineOptions options = settings.engine;
  // The first window teaches masks before a frame says what is wished of its pictures.
  static_cast<PictureWishes&>(options) = settings.wishes;
  options.threads = settings.wishes.threads;
  set_format(info, &options);
  options.frame_rate = GST_VIDEO_INFO_FPS_N(&info) > 0 && GST_VIDEO_INFO_FPS_D(&info) > 0
                           ? double(GST_VIDEO_INFO_FPS_N(&info)) / GST_VIDEO_INFO_FPS_D(&info)
                           : Latency::kAssumedRate;
  const bool configured = with_engine(state, [&](Engine& engine) {
    options.mask_scale = mask_scale_of(state, settings, info);
    // What was saved of video in all its pixels goes on so.
    if (settings.mask_scale == 0 && state.loaded &&
        state.loaded->learnt.width == GST_VIDEO_INFO_WIDTH(&info) &&
        state.loaded->learnt.height == GST_VIDEO_INFO_HEIGHT(&info))
      options.mask_scale = 1;
    state.reduces = settings.mask_scale == 0 && options.mask_scale > 1;
    state.background.keep(engine);
    state.background.set_caps(info, CapsPtr(gst_caps_ref(caps)));
    Status status =
        engine.configure(options, GST_VIDEO_INFO_WIDTH(&info), GST_VIDEO_INFO_HEIGHT(&info));
    state.colours = options.colours;
    if (status.ok())
      state.shells.reserve(static_cast<size_t>(engine.plan().layout().delay) + 1);
    else
      engine.flush();
    return status;
  });
  GST_OBJECT_LOCK(state.element);
  state.configure_asked |= !configured;
  GST_OBJECT_UNLOCK(state.element);
  return configured && apply_loaded(state);
}

bool is_same_video(const State& state, const GstVideoInfo& info) {
  GST_OBJECT_LOCK(state.element);
  const bool asked = state.configure_asked;
  GST_OBJECT_UNLOCK(state.element);
  return !asked && has_same_samples(state.info, info);
}

void follow_caps(State& state, const GstVideoInfo& info, GstCaps* caps) {
  state.info = info;
  const std::lock_guard lock(state.engine_lock);
  state.background.keep(state.engine);
  state.background.set_caps(info, CapsPtr(gst_caps_ref(caps)));
}

// How long a frame lasts; GST_CLOCK_TIME_NONE: nobody knows.
static GstClockTime frame_time(const GstVideoInfo& info) {
  const auto n = guint64(GST_VIDEO_INFO_FPS_N(&info)), d = guint64(GST_VIDEO_INFO_FPS_D(&info));
  return n > 0 ? gst_util_uint64_scale(GST_SECOND, d, n) : GST_CLOCK_TIME_NONE;
}

bool is_long_gap(const State& state, GstEvent* event) {
  return state.time.is_long(event, frame_time(state.info), state.segment->rate < 0);
}

GstFlowReturn prepare_for(State& state, GstBuffer* input) {
  follow_controllers(state, input);
  // The flag DISCONT says that frames are missing: that is no reason to forget what others showed.
  const StreamTime::Step step =
      state.time.step_to(GST_BUFFER_PTS(input), frame_time(state.info), state.segment->rate < 0);
  GST_OBJECT_LOCK(state.element);
  const bool reset = std::exchange(state.reset_asked, false);
  if (step == StreamTime::Step::gap) state.latency.pause();
  GST_OBJECT_UNLOCK(state.element);
  if (reset || step == StreamTime::Step::jump) {
    if (!reset) GST_DEBUG_OBJECT(state.element, "time jumps back: a new window begins");
    const GstFlowReturn flow = drain(state);
    if (!state.goes_on(flow)) return flow;
    state.objects.cut_off(state.element);
  }
  if (reset) {
    drop_frames(state);
    // Loaded after the reset was asked for.
    if (!apply_loaded(state)) return GST_FLOW_ERROR;
  }
  return GST_FLOW_OK;
}

// The time of the clock that sinks go by; before there is one, of the system's.
static GstClockTime time_now(GstElement* self) {
  ClockPtr clock(gst_element_get_clock(self));
  if (!clock) clock.reset(gst_system_clock_obtain());
  return gst_clock_get_time(clock.get());
}

// After a frame that came at the time `came`: whether the next to leave waits longer than sinks
// were told.
static void follow_latency(State& state, bool held_up, GstClockTime timestamp, GstClockTime came) {
  const GstClockTime now = held_up ? time_now(state.element) : came,
                     held = now > came ? now - came : 0;
  GST_OBJECT_LOCK(state.element);
  bool grew = state.latency.frame_in(timestamp);
  grew |= state.latency.held_up(held);
  if (state.engine.next())
    grew |= state.latency.frame_out(GST_BUFFER_PTS(state.shells.at(0)), held);
  const GstClockTime latency = state.latency.promised();
  GST_OBJECT_UNLOCK(state.element);
  if (!grew) return;
  GST_INFO_OBJECT(state.element, "latency is %" GST_TIME_FORMAT " by now", GST_TIME_ARGS(latency));
  gst_element_post_message(state.element, gst_message_new_latency(GST_OBJECT(state.element)));
}

// So many frames as come in that time; 0: never.
static gint64 absorb_frames(State& state, double seconds) {
  if (seconds <= 0) return 0;
  const GstVideoInfo* info = &state.info;
  const double rate = state.latency.rate(GST_VIDEO_INFO_FPS_N(info), GST_VIDEO_INFO_FPS_D(info));
  return gint64(std::clamp(std::round(seconds * rate), 1.0, 1e12));
}

// Metadata that is nothing but a hold on upstream's buffer.
static gboolean leave_parent(GstBuffer*, GstMeta** meta, gpointer) {
  if ((*meta)->info->api == GST_PARENT_BUFFER_META_API_TYPE) *meta = nullptr;
  return TRUE;
}

GstFlowReturn take_frame(State& state, BufferPtr buffer) {
  // The base class asks for frames until there is none, or until downstream refuses one (it has
  // ended, or is not linked); upstream may go on all the same. Nobody wants what is left.
  if (state.engine.next()) drop_frames(state);

  const GstClockTime came = time_now(state.element);
  GST_OBJECT_LOCK(state.element);
  const Settings settings = state.settings;
  GST_OBJECT_UNLOCK(state.element);
  warn_of_areas(state, settings);
  const bool masks = wants_objects(settings) || state.wants_masks(settings);
  BufferPtr shell(gst_buffer_new());
  gst_buffer_copy_into(
      shell.get(), buffer.get(),
      GstBufferCopyFlags(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS | GST_BUFFER_COPY_META),
      0, gsize(-1));
  gst_buffer_foreach_meta(shell.get(), leave_parent, nullptr);
  News news;
  {
    const MappedVideoFrame frame(&state.info, buffer.get(), GST_MAP_READ);
    if (!frame) {
      GST_ELEMENT_ERROR(state.element, STREAM, FORMAT,
                        ("A buffer does not hold a frame of the negotiated caps."), (nullptr));
      return GST_FLOW_ERROR;
    }
    const bool taken = with_engine(state, [&](Engine& engine) {
      const Clock::Span span(engine.clock(), Clock::frames);
      state.shells.push(std::move(shell));
      Wishes wishes = wishes_of(settings, buffer.get());
      wishes.masks_expected = masks;
      wishes.time_budget = settings.time_budget / 1000;
      wishes.absorb_frames = absorb_frames(state, settings.absorb_time);
      Status status = engine.push(frame.view<const uint8_t>(), &wishes);
      if (status.ok()) news = publish(state, 1, 0, nullptr);
      return status;
    });
    if (!taken) {
      drop_frames(state);
      return GST_FLOW_ERROR;
    }
  }
  tell_of_scene(state, news.engine, GST_BUFFER_PTS(buffer.get()));
  warn_of_no_room(state, news.engine);
  tell_of_solves(state, news);
  follow_latency(state, news.engine.held_up, GST_BUFFER_PTS(buffer.get()), came);
  return GST_FLOW_OK;
}

}  // namespace qdmd
