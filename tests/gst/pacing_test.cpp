// A live pipeline whose time a test advances: every frame is at the sink when it was promised, and
// no wall clock says so.
#include <gst/check/gsttestclock.h>

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
  Paced(const std::string& element, int told_rate, int frames) {
    GError* error = nullptr;
    pipeline_ = gst_parse_launch(
        ("videotestsrc is-live=true num-buffers=" + std::to_string(frames) +
         " ! video/x-raw,format=RGB,width=64,height=48,framerate=25/1 ! " + element +
         " name=q ! fakesink name=s sync=true qos=true signal-handoffs=true processing-deadline=0")
            .c_str(),
        &error);
    EXPECT_EQ(nullptr, error) << error->message;
    GstElement* tested = gst_bin_get_by_name(GST_BIN(pipeline_), "q");
    GstPad* pad = gst_element_get_static_pad(tested, "sink");
    gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, tell_rate,
                      GINT_TO_POINTER(told_rate), nullptr);
    gst_object_unref(pad);
    gst_object_unref(tested);
    clock_ = gst_test_clock_new();
    gst_pipeline_use_clock(GST_PIPELINE(pipeline_), clock_);
    arrivals.clock = clock_;
    arrivals.sink = gst_bin_get_by_name(GST_BIN(pipeline_), "s");
    g_signal_connect(arrivals.sink, "handoff", G_CALLBACK(note_arrival), &arrivals);
  }
  ~Paced() {
    gst_element_set_state(pipeline_, GST_STATE_NULL);
    gst_object_unref(arrivals.sink);
    gst_object_unref(pipeline_);
    gst_object_unref(clock_);
  }
  Paced(const Paced&) = delete;
  Paced& operator=(const Paced&) = delete;

  // Until the stream ends. One thread waits at a time, for a frame's time at the source or at the
  // sink: there is no queue.
  void run() {
    GstBus* bus = gst_element_get_bus(pipeline_);
    gst_element_set_state(pipeline_, GST_STATE_PLAYING);
    auto* clock = GST_TEST_CLOCK(clock_);
    for (bool going = true; going;) {
      while (GstMessage* message = gst_bus_pop(bus)) {
        if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_LATENCY) {
          gst_bin_recalculate_latency(GST_BIN(pipeline_));
          arrivals.latency = latency();
        }
        const bool error = GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR;
        EXPECT_FALSE(error);
        going = going && !error && GST_MESSAGE_TYPE(message) != GST_MESSAGE_EOS;
        gst_message_unref(message);
      }
      GstClockID waiting = nullptr;
      if (going && gst_test_clock_peek_next_pending_id(clock, &waiting)) {
        gst_clock_id_unref(waiting);
        gst_test_clock_crank(clock);
      } else if (going) {
        g_usleep(200);
      }
    }
    gst_object_unref(bus);
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
};

void expect_in_time(const std::string& element, int told_rate, size_t frames) {
  SCOPED_TRACE(element + " told of " + std::to_string(told_rate) + " frames per second");
  Paced paced(element, told_rate, static_cast<int>(frames));
  paced.run();
  const Arrivals& arrivals = paced.arrivals;
  ASSERT_EQ(frames, arrivals.came.size());
  for (size_t t = 0; t < frames; ++t) {
    EXPECT_LE(arrivals.came[t], arrivals.due[t]) << t;
    if (t == 0) continue;
    EXPECT_GT(arrivals.pts[t], arrivals.pts[t - 1]) << t;
    EXPECT_LT(arrivals.came[t] - arrivals.came[t - 1], 3 * kFrame) << t;
  }
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

}  // namespace
}  // namespace qdmd::test
