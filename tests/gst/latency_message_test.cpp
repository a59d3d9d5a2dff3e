// SPDX-License-Identifier: LGPL-2.1-or-later
// When qdmdbackground tells its pipeline of another latency, by clocks of the tests' own.
#include <gst/video/gstvideometa.h>

#include <utility>

#include "tests/gst/watched_element.h"

namespace qdmd::test {
namespace {

TEST(LatencyMessage, IsPostedOnceForEachChange) {
  Stream stream("qdmdbackground window-size=8", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  stream.push_many(0, 8);
  EXPECT_EQ(0, element.latency_messages()) << "it was posted with the first caps";
  stream.set_caps(GST_VIDEO_FORMAT_RGB, 16, 16);
  stream.push_many(8, 8);
  EXPECT_EQ(0, element.latency_messages()) << "the rate is the same";
  stream.set_caps(GST_VIDEO_FORMAT_RGB, 16, 16, 50);
  EXPECT_EQ(1, element.latency_messages());
  EXPECT_EQ(7 * GST_SECOND / 50, gst_harness_query_latency(stream.harness()));
  stream.set_caps(GST_VIDEO_FORMAT_RGB, 16, 16, 0);
  EXPECT_EQ(1, element.latency_messages());
  EXPECT_EQ(7 * GST_SECOND / 25, gst_harness_query_latency(stream.harness()));
}

// Frames of 10 a second, whatever the caps say.
TEST(LatencyMessage, IsPostedWhereFramesComeMoreSlowlyThanTheCapsSay) {
  constexpr GstClockTime kInterval = GST_SECOND / 10;
  for (int rate : {0, 25}) {
    Stream stream("qdmdbackground window-size=8", GST_VIDEO_FORMAT_RGB, 40, 24, rate);
    Element element(stream);
    for (int t = 0; t < 40; ++t) {
      auto buffer = stream.make_frame(t, paint_mover);
      GST_BUFFER_PTS(buffer.get()) = static_cast<GstClockTime>(t) * kInterval;
      GST_BUFFER_DURATION(buffer.get()) = kInterval;
      ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
      if (t < 7) {
        EXPECT_EQ(0, element.latency_messages()) << t;
        EXPECT_EQ(7 * kFrame, gst_harness_query_latency(stream.harness())) << t;
      } else {
        // The first has left.
        if (t == 7) {
          EXPECT_GE(element.latency_messages(), 1);
        }
        EXPECT_GE(gst_harness_query_latency(stream.harness()), 7 * kInterval) << t;
      }
    }
    EXPECT_EQ(33u, stream.take_all().size());
  }
}

// What lies between two scenes is no frame's time.
TEST(LatencyMessage, NoneForAJumpInTime) {
  Stream stream("qdmdbackground method=qdmd window-size=8", GST_VIDEO_FORMAT_RGB, 40, 24);
  stream.push_many(0, 20);
  EXPECT_EQ(7 * kFrame, gst_harness_query_latency(stream.harness()));
  stream.push_many(1000, 60);
  EXPECT_EQ(7 * kFrame, gst_harness_query_latency(stream.harness()));
}

// By the clock of the harness, which goes on while the frame is read.
GstTestClock* slow_clock = nullptr;
constexpr GstClockTime kSlow = 300 * GST_MSECOND;
gboolean map_slowly(GstVideoMeta* meta, guint plane, GstMapInfo* info, gpointer* data, gint* stride,
                    GstMapFlags flags) {
  if (plane == 0) gst_test_clock_advance_time(slow_clock, kSlow);
  if (!gst_buffer_map(meta->buffer, info, flags)) return FALSE;
  *data = info->data + meta->offset[plane];
  *stride = meta->stride[plane];
  return TRUE;
}
gboolean unmap(GstVideoMeta* meta, guint, GstMapInfo* info) {
  gst_buffer_unmap(meta->buffer, info);
  return TRUE;
}

// With one thread a solve is done with the last frame of its window, and its background comes into
// use some frames later: it is the first that holds the stream up, and sinks learn of it at once.
// What takes long without a solve is none of the element's.
TEST(LatencyMessage, IsPostedWhereASolveHoldsAFrameUp) {
  constexpr int kWindow = 8, kRate = 100000, kLate = kWindow / 4;
  for (int slow : {kWindow - 1, 2 * kWindow - 1, kWindow, kWindow + kLate}) {
    SCOPED_TRACE("frame " + std::to_string(slow));
    Stream stream("qdmdbackground n-threads=1 window-size=" + std::to_string(kWindow),
                  GST_VIDEO_FORMAT_RGB, 64, 48, kRate);
    slow_clock = gst_harness_get_testclock(stream.harness());
    ASSERT_NE(nullptr, slow_clock);
    const bool solved = slow % kWindow == kWindow - 1;
    GstClockTime promised = 0;
    for (int t = 0; t < 3 * kWindow; ++t) {
      auto buffer = stream.make_frame(t, paint_mover);
      GST_BUFFER_PTS(buffer.get()) = gst_util_uint64_scale(t, GST_SECOND, kRate);
      if (t == slow) {
        GstVideoMeta* meta =
            gst_buffer_add_video_meta(buffer.get(), GST_VIDEO_FRAME_FLAG_NONE, GST_VIDEO_FORMAT_RGB,
                                      guint(stream.info().width), guint(stream.info().height));
        meta->map = map_slowly;
        meta->unmap = unmap;
      }
      ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
      const GstClockTime before =
          std::exchange(promised, gst_harness_query_latency(stream.harness()));
      if (t == 0) {
        EXPECT_EQ(gst_util_uint64_scale(kWindow - 1 + kLate, GST_SECOND, kRate), promised);
      } else if (t == slow && solved) {
        EXPECT_GE(promised, before + kSlow);
        EXPECT_LE(promised, before + 2 * kSlow);
      } else {
        EXPECT_EQ(promised, before) << t;
      }
    }
    gst_object_unref(slow_clock);
  }
}

TEST(LatencyMessage, OfAnotherWindowSizeComesWithTheNextStart) {
  // Before it plays, a pipeline has no other clock than the system's.
  GstClock* clock = gst_test_clock_new();
  gst_system_clock_set_default(clock);
  GstElement* pipeline = gst_parse_launch(
      "videotestsrc num-buffers=20 ! video/x-raw,format=RGB,width=16,height=16,framerate=25/1 ! "
      "qdmdbackground name=q window-size=5 ! fakesink",
      nullptr);
  GstElement* element = gst_bin_get_by_name(GST_BIN(pipeline), "q");
  for (guint size : {5u, 9u}) {
    g_object_set(element, "window-size", size, nullptr);
    gst_element_set_state(pipeline, GST_STATE_PAUSED);
    gst_element_get_state(pipeline, nullptr, nullptr, 60 * GST_SECOND);
    GstPad* pad = gst_element_get_static_pad(element, "src");
    GstQuery* query = gst_query_new_latency();
    EXPECT_TRUE(gst_pad_query(pad, query));
    GstClockTime min = 0;
    gst_query_parse_latency(query, nullptr, &min, nullptr);
    EXPECT_EQ((size - 1 + 1) * kFrame, min) << "the source has a frame's latency of its own";
    gst_query_unref(query);
    gst_object_unref(pad);
    gst_element_set_state(pipeline, GST_STATE_READY);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(element);
  gst_object_unref(pipeline);
  gst_system_clock_set_default(nullptr);
  gst_object_unref(clock);
}

}  // namespace
}  // namespace qdmd::test
