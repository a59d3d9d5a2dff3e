// SPDX-License-Identifier: LGPL-2.1-or-later
// A live pipeline whose time a test advances: every frame is at the sink when it was promised, and
// no wall clock says so.
#include <gst/check/gsttestclock.h>
#include <gst/video/gstvideometa.h>

#include <atomic>

#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

// What the sink saw: when each frame came, and when it was due.
struct Arrivals {
  GstClock* clock = nullptr;
  GstElement* sink = nullptr;
  std::vector<GstClockTime> came, due, pts;
  std::atomic<GstClockTime> latency = 0;
};

// The sink has waited for the frame's time, unless it was late.
void note_arrival(GstElement*, GstBuffer* buffer, GstPad*, gpointer data) {
  auto* arrivals = static_cast<Arrivals*>(data);
  arrivals->came.push_back(gst_clock_get_time(arrivals->clock));
  arrivals->due.push_back(GST_BUFFER_PTS(buffer) + arrivals->latency);
  arrivals->pts.push_back(GST_BUFFER_PTS(buffer));
}

// Caps that say another rate than that of the frames.
GstPadProbeReturn tell_rate(GstPad*, GstPadProbeInfo* info, gpointer rate) {
  GstEvent* event = GST_PAD_PROBE_INFO_EVENT(info);
  if (GST_EVENT_TYPE(event) != GST_EVENT_CAPS) return GST_PAD_PROBE_OK;
  GstCaps* caps = nullptr;
  gst_event_parse_caps(event, &caps);
  caps = gst_caps_copy(caps);
  gst_caps_set_simple(caps, "framerate", GST_TYPE_FRACTION, GPOINTER_TO_INT(rate), 1, nullptr);
  gst_event_unref(event);
  GST_PAD_PROBE_INFO_DATA(info) = gst_event_new_caps(caps);
  gst_caps_unref(caps);
  return GST_PAD_PROBE_OK;
}

class Paced {
 public:
  // source: its frames are live. told_rate: what the caps say.
  Paced(const std::string& source, const std::string& element, int told_rate) {
    GError* error = nullptr;
    pipeline_ = gst_parse_launch(
        (source + " ! " + element +
         " name=q ! fakesink name=s sync=true qos=true signal-handoffs=true processing-deadline=0")
            .c_str(),
        &error);
    EXPECT_EQ(nullptr, error) << error->message;
    GstElement* tested = this->element("q");
    GstPad* pad = gst_element_get_static_pad(tested, "sink");
    gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, tell_rate,
                      GINT_TO_POINTER(told_rate), nullptr);
    gst_object_unref(pad);
    gst_object_unref(tested);
    clock_ = gst_test_clock_new();
    gst_pipeline_use_clock(GST_PIPELINE(pipeline_), clock_);
    bus_ = gst_element_get_bus(pipeline_);
    arrivals.clock = clock_;
    arrivals.sink = this->element("s");
    g_signal_connect(arrivals.sink, "handoff", G_CALLBACK(note_arrival), &arrivals);
  }
  ~Paced() {
    gst_element_set_state(pipeline_, GST_STATE_NULL);
    gst_object_unref(arrivals.sink);
    gst_object_unref(bus_);
    gst_object_unref(pipeline_);
    gst_object_unref(clock_);
  }
  Paced(const Paced&) = delete;
  Paced& operator=(const Paced&) = delete;

  GstElement* element(const char* name) { return gst_bin_get_by_name(GST_BIN(pipeline_), name); }
  GstTestClock* clock() { return GST_TEST_CLOCK(clock_); }
  void play() { gst_element_set_state(pipeline_, GST_STATE_PLAYING); }
  // Hears what the pipeline says. False: the stream has ended.
  bool goes_on() {
    while (GstMessage* message = gst_bus_pop(bus_)) {
      if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_LATENCY) {
        gst_bin_recalculate_latency(GST_BIN(pipeline_));
        arrivals.latency = latency();
      }
      const bool error = GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR;
      EXPECT_FALSE(error);
      if (error || GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS) ended_ = true;
      gst_message_unref(message);
    }
    return !ended_;
  }
  // The time that a thread waits for; none: no thread does.
  GstClockTime next_wait() {
    GstClockID waiting = nullptr;
    if (!gst_test_clock_peek_next_pending_id(clock(), &waiting)) return GST_CLOCK_TIME_NONE;
    const GstClockTime time = gst_clock_id_get_time(waiting);
    gst_clock_id_unref(waiting);
    return time;
  }
  void advance() { gst_test_clock_crank(clock()); }
  // Until the stream ends. One thread waits at a time, for a frame's time at the source or at the
  // sink: there is no queue.
  void run() {
    while (goes_on())
      if (GST_CLOCK_TIME_IS_VALID(next_wait()))
        advance();
      else
        g_usleep(200);
  }

  Arrivals arrivals;

 private:
  // What sinks are told.
  GstClockTime latency() {
    GstQuery* query = gst_query_new_latency();
    GstClockTime least = 0;
    EXPECT_TRUE(gst_element_query(pipeline_, query));
    gst_query_parse_latency(query, nullptr, &least, nullptr);
    gst_query_unref(query);
    return least;
  }

  GstElement* pipeline_;
  GstClock* clock_;
  GstBus* bus_;
  bool ended_ = false;
};

// `interval` apart.
void expect_in_time(const Arrivals& arrivals, size_t frames, GstClockTime interval) {
  ASSERT_EQ(frames, arrivals.came.size());
  for (size_t t = 0; t < frames; ++t) {
    EXPECT_LE(arrivals.came[t], arrivals.due[t]) << t;
    if (t == 0) continue;
    EXPECT_GT(arrivals.pts[t], arrivals.pts[t - 1]) << t;
    EXPECT_LT(arrivals.came[t] - arrivals.came[t - 1], 3 * interval) << t;
  }
}

void expect_in_time(const std::string& element, int told_rate, size_t frames) {
  SCOPED_TRACE(element + " told of " + std::to_string(told_rate) + " frames per second");
  Paced paced("videotestsrc is-live=true num-buffers=" + std::to_string(frames) +
                  " ! video/x-raw,format=RGB,width=64,height=48,framerate=25/1",
              element, told_rate);
  paced.play();
  paced.run();
  expect_in_time(paced.arrivals, frames, kFrame);
}

// Across windows, whether they are solved at once or beside the frames that follow, and at the end.
TEST(PacingByATestClock, EveryFrameIsInTime) {
  expect_in_time("qdmdbackground window-size=8 method=qdmd", 25, 30);
  expect_in_time("qdmdbackground window-size=20", 25, 70);
  expect_in_time("qdmdbackground window-size=20 mode=live", 25, 50);
}

// The caps' rate is not what frames keep to; 0: they have none.
TEST(PacingByATestClock, EveryFrameIsInTimeWhateverTheCapsSay) {
  for (int rate : {0, 10, 50})
    expect_in_time("qdmdbackground window-size=20 method=qdmd", rate, 70);
}

// ---- A camera with few buffers ----

// Counts the frames that the element has done with: its pad's own function, and then one more.
GstPadChainFunction chain_of_element = nullptr;
std::atomic<int> frames_done;
GstFlowReturn chain_and_count(GstPad* pad, GstObject* parent, GstBuffer* buffer) {
  const GstFlowReturn flow = chain_of_element(pad, parent, buffer);
  ++frames_done;
  return flow;
}

// The element's clock goes on while it reads the frame.
constexpr GstClockTime kSlow = 400 * GST_MSECOND;
GstClock* clock_of_slow_frame = nullptr;
gboolean map_slowly(GstVideoMeta* meta, guint plane, GstMapInfo* info, gpointer* data, gint* stride,
                    GstMapFlags flags) {
  GstClockID id = gst_clock_new_single_shot_id(clock_of_slow_frame,
                                               gst_clock_get_time(clock_of_slow_frame) + kSlow);
  gst_clock_id_wait(id, nullptr);
  gst_clock_id_unref(id);
  if (!gst_buffer_map(meta->buffer, info, flags)) return FALSE;
  *data = info->data + meta->offset[plane];
  *stride = meta->stride[plane];
  return TRUE;
}
gboolean unmap(GstVideoMeta* meta, guint, GstMapInfo* info) {
  gst_buffer_unmap(meta->buffer, info);
  return TRUE;
}

// As v4l2src: a frame for which no buffer is free when its time comes is lost, whatever the
// streaming thread does meanwhile.
class Camera {
 public:
  Camera(Paced* paced, int buffers, int rate) : paced_(paced), rate_(rate) {
    gst_video_info_set_format(&info_, GST_VIDEO_FORMAT_RGB, 64, 48);
    info_.fps_n = rate;
    info_.fps_d = 1;
    GstCaps* caps = gst_video_info_to_caps(&info_);
    source_ = paced->element("camera");
    g_object_set(source_, "caps", caps, "min-latency", gint64(time_of(1)), "max-latency",
                 gint64(time_of(buffers)), nullptr);
    pool_ = gst_buffer_pool_new();
    GstStructure* config = gst_buffer_pool_get_config(pool_);
    gst_buffer_pool_config_set_params(config, caps, guint(info_.size), guint(buffers),
                                      guint(buffers));
    gst_caps_unref(caps);
    EXPECT_TRUE(gst_buffer_pool_set_config(pool_, config));
    EXPECT_TRUE(gst_buffer_pool_set_active(pool_, TRUE));
    GstElement* tested = paced->element("q");
    GstPad* pad = gst_element_get_static_pad(tested, "sink");
    chain_of_element = GST_PAD_CHAINFUNC(pad);
    frames_done = 0;
    gst_pad_set_chain_function(pad, chain_and_count);
    gst_object_unref(pad);
    gst_object_unref(tested);
  }
  ~Camera() {
    gst_buffer_pool_set_active(pool_, FALSE);
    gst_object_unref(pool_);
    gst_object_unref(source_);
  }
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  GstClockTime time_of(int t) const {
    return gst_util_uint64_scale(guint64(t), GST_SECOND, guint64(rate_));
  }
  // Returns how many were lost. Reading frame `slow` takes the element long.
  int film(int frames, int slow = -1) {
    int lost = 0;
    for (int t = 0; t < frames; ++t) {
      wait_until(time_of(t));
      GstBuffer* buffer = nullptr;
      GstBufferPoolAcquireParams params = {};
      params.flags = GST_BUFFER_POOL_ACQUIRE_FLAG_DONTWAIT;
      if (gst_buffer_pool_acquire_buffer(pool_, &buffer, &params) != GST_FLOW_OK) {
        ++lost;
        continue;
      }
      gst_buffer_memset(buffer, 0, 90, info_.size);
      gst_buffer_memset(buffer, gsize(t * 31) % (info_.size - 300), 200, 300);
      if (t == slow) {
        GstVideoMeta* meta =
            gst_buffer_add_video_meta(buffer, GST_VIDEO_FRAME_FLAG_NONE, GST_VIDEO_FORMAT_RGB,
                                      guint(info_.width), guint(info_.height));
        meta->map = map_slowly;
        meta->unmap = unmap;
        clock_of_slow_frame = GST_CLOCK(paced_->clock());
      }
      GST_BUFFER_PTS(buffer) = time_of(t);
      GST_BUFFER_DURATION(buffer) = time_of(1);
      GstFlowReturn flow = GST_FLOW_ERROR;
      g_signal_emit_by_name(source_, "push-buffer", buffer, &flow);
      gst_buffer_unref(buffer);
      EXPECT_EQ(GST_FLOW_OK, flow);
      ++sent_;
    }
    wait_until(time_of(frames));
    GstFlowReturn flow = GST_FLOW_ERROR;
    g_signal_emit_by_name(source_, "end-of-stream", &flow);
    return lost;
  }

 private:
  // What can be done until then is done: the streaming thread has no frame left, or waits at the
  // sink for a later time.
  void wait_until(GstClockTime time) {
    while (paced_->goes_on()) {
      const bool idle = frames_done == sent_;
      const GstClockTime next = paced_->next_wait();
      if (GST_CLOCK_TIME_IS_VALID(next) && next <= time)
        paced_->advance();
      else if (idle || GST_CLOCK_TIME_IS_VALID(next))
        break;
      else
        g_usleep(50);
    }
    gst_test_clock_set_time(paced_->clock(), time);
  }

  Paced* paced_;
  int rate_;
  GstVideoInfo info_;
  GstElement* source_;
  GstBufferPool* pool_;
  int sent_ = 0;
};

// Sinks wait for as long as they are told, and the camera's thread with them: what the element
// tells may be longer than what it holds frames for by less than the camera has buffers.
TEST(PacingByATestClock, ACameraOfFourBuffersLosesNoFrame) {
  constexpr int kFrames = 250;
  const auto expect_none_lost = [](const std::string& element, int rate, int told_rate) {
    SCOPED_TRACE(element + " at " + std::to_string(rate) + " frames per second, told of " +
                 std::to_string(told_rate));
    Paced paced("appsrc name=camera is-live=true format=time", element, told_rate);
    Camera camera(&paced, 4, rate);
    paced.play();
    EXPECT_EQ(0, camera.film(kFrames));
    paced.run();
    expect_in_time(paced.arrivals, kFrames, camera.time_of(1));
  };
  for (const char* element :
       {"qdmdbackground window-size=100", "qdmdbackground window-size=20",
        "qdmdbackground window-size=20 n-threads=1", "qdmdbackground window-size=20 method=qdmd",
        "qdmdbackground mode=live"})
    // The faster one gives a solve the time of some frames.
    for (int rate : {30, 2000}) expect_none_lost(element, rate, rate);
  // Once it is known, latency is that of the frames' own rate.
  expect_none_lost("qdmdbackground window-size=100", 15, 30);
  expect_none_lost("qdmdbackground window-size=100", 15, 0);
}

// A solve that holds the stream up for longer than the camera has buffers costs the frames of that
// time, and none after it: what sinks wait for is no more than what the camera keeps.
TEST(PacingByATestClock, ASolveThatTakesTooLongCostsNoFramesLater) {
  constexpr int kRate = 30, kWindow = 20, kFrames = 300;
  constexpr int kFramesOfSlow = int(kSlow * kRate / GST_SECOND);
  for (int slow : {kWindow - 1, 2 * kWindow - 1}) {
    SCOPED_TRACE("frame " + std::to_string(slow));
    Paced paced("appsrc name=camera is-live=true format=time",
                "qdmdbackground n-threads=1 window-size=" + std::to_string(kWindow), kRate);
    Camera camera(&paced, 4, kRate);
    paced.play();
    const int lost = camera.film(kFrames, slow);
    EXPECT_GT(lost, 0);
    EXPECT_LE(lost, kFramesOfSlow);
    paced.run();
    EXPECT_EQ(size_t(kFrames - lost), paced.arrivals.came.size());
  }
}

}  // namespace
}  // namespace qdmd::test
