// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames in and frames out: counts, order, timestamps, flags, metadata, events.
#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

void expect_frames(const std::vector<BufferPtr>& out, int first, int count) {
  ASSERT_EQ(static_cast<size_t>(count), out.size());
  for (int i = 0; i < count; ++i) {
    const GstBuffer* buffer = out[static_cast<size_t>(i)].get();
    EXPECT_EQ(static_cast<GstClockTime>(first + i) * kFrame, GST_BUFFER_PTS(buffer));
    EXPECT_EQ(kFrame, GST_BUFFER_DURATION(buffer));
    EXPECT_EQ(static_cast<guint64>(first + i), GST_BUFFER_OFFSET(buffer));
  }
}

class FrameCount : public testing::TestWithParam<int> {};

TEST_P(FrameCount, AllComeOutInOrderWithTheirTimestamps) {
  Stream stream("qdmdbackground window-size=20", GST_VIDEO_FORMAT_RGB, 40, 24);
  const int count = GetParam();
  // With the twentieth, the first: from then on one in, one out.
  for (int t = 0; t < count; ++t) {
    ASSERT_EQ(GST_FLOW_OK, stream.push(t));
    expect_frames(stream.take_all(), t - 19, t < 19 ? 0 : 1);
  }
  const int left = std::min(count, 19);
  EXPECT_TRUE(stream.eos());
  expect_frames(stream.take_all(), count - left, left);
}

INSTANTIATE_TEST_SUITE_P(AroundTheWindow, FrameCount, testing::Values(1, 2, 7, 19, 20, 21, 47, 60));

// Larger pictures that come fast are solved while others come, which the latency tells.
TEST(FrameCount, OfWindowsThatAreSolvedBesideTheFrames) {
  constexpr int kRate = 1000, kWindow = 20;
  Stream stream("qdmdbackground window-size=20", GST_VIDEO_FORMAT_RGB, 160, 120, kRate);
  std::vector<BufferPtr> frames;
  for (int t = 0; t < 100; ++t) {
    frames.push_back(stream.make_frame(t, paint_mover));
    GST_BUFFER_PTS(frames.back().get()) = static_cast<GstClockTime>(t) * GST_SECOND / kRate;
    GST_BUFFER_DURATION(frames.back().get()) = GST_SECOND / kRate;
  }
  const auto delay = static_cast<int>(
      gst_util_uint64_scale(gst_harness_query_latency(stream.harness()), kRate, GST_SECOND));
  EXPECT_GT(delay, kWindow - 1);
  EXPECT_LT(delay, 2 * kWindow);
  guint64 next = 0;
  for (int t = 0; t < 100; ++t) {
    ASSERT_EQ(GST_FLOW_OK,
              gst_harness_push(stream.harness(), frames[static_cast<size_t>(t)].release()));
    const auto out = stream.take_all();
    ASSERT_EQ(t < delay ? 0u : 1u, out.size()) << t;
    for (const auto& buffer : out) EXPECT_EQ(next++, GST_BUFFER_OFFSET(buffer.get()));
  }
  for (const auto& buffer : stream.take_to_end())
    EXPECT_EQ(next++, GST_BUFFER_OFFSET(buffer.get()));
  EXPECT_EQ(100u, next);
}

// A sink that has seen enough, or that is not there, is no error of ours, whoever feeds us.
TEST(Downstream, MayEndInTheMiddleOfAWindow) {
  for (const char* launch :
       {"videotestsrc num-buffers=150 ! queue ! qdmdbackground window-size=20 ! "
        "fakesink num-buffers=25",
        "videotestsrc num-buffers=150 ! tee name=t t. ! queue ! qdmdbackground window-size=20 ! "
        "identity eos-after=7 ! fakesink t. ! queue ! fakesink",
        "videotestsrc num-buffers=60 ! tee name=t t. ! qdmdbackground window-size=5 "
        "t. ! queue ! fakesink"}) {
    SCOPED_TRACE(launch);
    GstElement* pipeline = gst_parse_launch(launch, nullptr);
    ASSERT_TRUE(pipeline);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    GstBus* bus = gst_element_get_bus(pipeline);
    GstMessage* message = gst_bus_timed_pop_filtered(
        bus, 60 * GST_SECOND, GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
    ASSERT_TRUE(message) << "it did not end";
    EXPECT_EQ(GST_MESSAGE_EOS, GST_MESSAGE_TYPE(message));
    gst_message_unref(message);
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(bus);
    gst_object_unref(pipeline);
  }
}

TEST(Content, EachOutputBelongsToItsOwnFrame) {
  // With the background removed, what stays of each frame is its own square.
  for (int count : {20, 33}) {
    Stream stream("qdmdbackground window-size=20 output=mask", GST_VIDEO_FORMAT_RGB, 40, 24);
    stream.push_many(0, count);
    ASSERT_TRUE(stream.eos());
    const auto out = stream.take_all();
    ASSERT_EQ(static_cast<size_t>(count), out.size());
    for (int t = 0; t < count; ++t) {
      const int left = (3 * t) % 32;
      int inside = 0;
      stream.each_pixel(out[static_cast<size_t>(t)].get(),
                        [&](int x, int y, const uint8_t* p, int) {
                          EXPECT_TRUE((p[0] == 0 || p[0] == 255) && p[1] == p[0] && p[2] == p[0]);
                          if (x >= left && x < left + 4 && y >= 4 && y < 9) inside += p[0] == 255;
                        });
      EXPECT_EQ(20, inside) << "frame " << t << " of " << count;
    }
  }
}

TEST(Content, StillWindowsGiveTheirFrameBack) {
  const Painter black = [](int, int, int, uint8_t* p) { p[0] = p[1] = p[2] = 0; };
  const Painter white = [](int, int, int, uint8_t* p) { p[0] = p[1] = p[2] = 255; };
  for (const char* options :
       {"", "method=dmd", "solver=adjoint", "solver=qr", "solver=gram-extended",
        "amplitude=first-frame", "method=dmd amplitude=first-frame", "rank=1"})
    for (const Painter& paint : {Painter(paint_still), black, white})
      for (int width : {1, 13})
        for (int count : {1, 2, 9}) {
          Stream stream(std::string("qdmdbackground window-size=5 ") + options,
                        GST_VIDEO_FORMAT_RGB, width, width);
          stream.push_many(0, count, paint);
          ASSERT_TRUE(stream.eos());
          const auto out = stream.take_all();
          ASSERT_EQ(static_cast<size_t>(count), out.size());
          for (const auto& buffer : out)
            stream.each_pixel(buffer.get(), [&](int x, int y, const uint8_t* p, int) {
              uint8_t expected[3];
              paint(0, x, y, expected);
              ASSERT_EQ(0, std::memcmp(expected, p, 3)) << options << " at " << x << ", " << y;
            });
        }
}

// The samples of every output buffer; what lies between rows may be anything.
std::vector<std::vector<uint8_t>> output_samples(const std::string& options, int width,
                                                 int height) {
  Stream stream("qdmdbackground window-size=12 " + options, GST_VIDEO_FORMAT_RGB, width, height);
  stream.push_many(0, 30);
  EXPECT_TRUE(stream.eos());
  std::vector<std::vector<uint8_t>> all;
  for (const auto& buffer : stream.take_all()) {
    std::vector<uint8_t> samples;
    stream.each_pixel(buffer.get(), [&](int, int, const uint8_t* p, int) {
      samples.insert(samples.end(), p, p + 3);
    });
    all.push_back(std::move(samples));
  }
  return all;
}

TEST(Content, IsTheSameForAnyNumberOfThreads) {
  // 4 frames against 12 of 161 x 123 pixels: enough products for as many threads as are asked for.
  for (const char* output : {"background", "foreground", "mask", "cutout"}) {
    const std::string options = std::string("output=") + output + " n-threads=";
    const auto one = output_samples(options + "1", 161, 123);
    ASSERT_EQ(30u, one.size());
    for (const char* threads : {"2", "3", "0"})
      EXPECT_EQ(one, output_samples(options + threads, 161, 123)) << output << ", " << threads;
  }
}

TEST(Content, InputBuffersStayAsTheyWere) {
  Stream stream("qdmdbackground window-size=3 output=cutout", GST_VIDEO_FORMAT_RGBA, 17, 9);
  std::vector<BufferPtr> kept;
  for (int t = 0; t < 6; ++t) {
    kept.push_back(stream.make_frame(t, paint_mover));
    // A second reference makes the buffer read-only.
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), gst_buffer_ref(kept.back().get())));
  }
  for (int t = 0; t < 6; ++t) {
    const auto again = stream.make_frame(t, paint_mover);
    GstMapInfo map;
    ASSERT_TRUE(gst_buffer_map(again.get(), &map, GST_MAP_READ));
    EXPECT_EQ(0, gst_buffer_memcmp(kept[static_cast<size_t>(t)].get(), 0, map.data, map.size));
    gst_buffer_unmap(again.get(), &map);
  }
}

TEST(Flags, OnlyTheFirstFrameIsDiscont) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 8, 8);
  stream.push_many(0, 12);
  ASSERT_TRUE(stream.eos());
  const auto out = stream.take_all();
  ASSERT_EQ(12u, out.size());
  for (size_t i = 1; i < out.size(); ++i) EXPECT_FALSE(GST_BUFFER_IS_DISCONT(out[i].get())) << i;
}

TEST(Flags, EachFrameKeepsItsOwn) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 8, 8);
  for (int t = 0; t < 5; ++t) {
    auto buffer = stream.make_frame(t, paint_mover);
    if (t == 3) GST_BUFFER_FLAG_SET(buffer.get(), GST_BUFFER_FLAG_MARKER);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
  }
  const auto out = stream.take_to_end();
  ASSERT_EQ(5u, out.size());
  for (size_t t = 0; t < 5; ++t)
    EXPECT_EQ(t == 3, GST_BUFFER_FLAG_IS_SET(out[t].get(), GST_BUFFER_FLAG_MARKER)) << t;
}

// Those before it that wait do not get it.
TEST(Flags, DiscontStaysWithItsFrame) {
  Stream stream("qdmdbackground window-size=10", GST_VIDEO_FORMAT_RGB, 8, 8);
  for (int t = 0; t < 14; ++t) {
    auto buffer = stream.make_frame(t, paint_mover);
    if (t == 4) GST_BUFFER_FLAG_SET(buffer.get(), GST_BUFFER_FLAG_DISCONT);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
  }
  const auto out = stream.take_to_end();
  expect_frames(out, 0, 14);
  for (size_t t = 0; t < 14; ++t)
    EXPECT_EQ(t == 4, static_cast<bool>(GST_BUFFER_IS_DISCONT(out[t].get()))) << t;
}

TEST(Metadata, RegionsOfInterestStayWithTheirFrame) {
  Stream stream("qdmdbackground window-size=4", GST_VIDEO_FORMAT_RGB, 16, 16);
  for (int t = 0; t < 4; ++t) {
    auto buffer = stream.make_frame(t, paint_mover);
    gst_buffer_add_video_region_of_interest_meta(buffer.get(), "face", static_cast<guint>(t), 2, 3,
                                                 4);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
  }
  const auto out = stream.take_to_end();
  ASSERT_EQ(4u, out.size());
  for (guint t = 0; t < 4; ++t) {
    const auto* meta = reinterpret_cast<GstVideoRegionOfInterestMeta*>(
        gst_buffer_get_meta(out[t].get(), GST_VIDEO_REGION_OF_INTEREST_META_API_TYPE));
    ASSERT_NE(nullptr, meta) << t;
    EXPECT_EQ(t, meta->x);
  }
}

TEST(Events, GapDoesNotOvertakeFrames) {
  Stream stream("qdmdbackground window-size=10", GST_VIDEO_FORMAT_RGB, 8, 8);
  stream.push_many(0, 3);
  ASSERT_TRUE(
      gst_harness_push_event(stream.harness(), gst_event_new_gap(3 * kFrame, 10 * GST_SECOND)));
  expect_frames(stream.take_all(), 0, 3);
}

TEST(Events, CapsChangeSendsTheOldFramesFirst) {
  Stream stream("qdmdbackground window-size=10", GST_VIDEO_FORMAT_RGB, 24, 16);
  stream.push_many(0, 14);
  expect_frames(stream.take_all(), 0, 5);
  const auto old_size = stream.info().size;
  stream.set_caps(GST_VIDEO_FORMAT_BGRA, 31, 9);
  const auto before = stream.take_all();
  expect_frames(before, 5, 9);
  for (const auto& buffer : before) EXPECT_EQ(old_size, gst_buffer_get_size(buffer.get()));
  stream.push_many(14, 11);
  auto out = stream.take_all();
  expect_frames(out, 14, 2);
  for (auto& buffer : stream.take_to_end()) out.push_back(std::move(buffer));
  expect_frames(out, 14, 11);
  for (size_t i = 0; i < out.size(); ++i)
    EXPECT_EQ(stream.info().size, gst_buffer_get_size(out[i].get())) << i;
}

TEST(Events, EqualCapsDoNotEndTheWindow) {
  Stream stream("qdmdbackground window-size=10", GST_VIDEO_FORMAT_RGB, 24, 16);
  stream.push_many(0, 6);
  ASSERT_TRUE(gst_harness_push_event(
      stream.harness(),
      gst_event_new_caps(
          std::unique_ptr<GstCaps, decltype(&gst_caps_unref)>(
              gst_video_info_to_caps(const_cast<GstVideoInfo*>(&stream.info())), gst_caps_unref)
              .get())));
  EXPECT_TRUE(stream.take_all().empty());
  stream.push_many(6, 4);
  expect_frames(stream.take_all(), 0, 1);
  expect_frames(stream.take_to_end(), 1, 9);
}

TEST(Events, FlushDropsTheWindow) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 8, 8);
  stream.push_many(0, 4);
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_start()));
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_stop(TRUE)));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_segment(&segment)));
  EXPECT_TRUE(stream.take_all().empty());
  stream.push_many(50, 4);
  EXPECT_TRUE(stream.take_all().empty());
  stream.push_many(54, 1);
  expect_frames(stream.take_all(), 50, 1);
  // With frames of two windows.
  stream.push_many(55, 2);
  expect_frames(stream.take_all(), 51, 2);
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_start()));
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_stop(TRUE)));
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_segment(&segment)));
  stream.push_many(70, 5);
  expect_frames(stream.take_all(), 70, 1);
  expect_frames(stream.take_to_end(), 71, 4);
}

TEST(Events, QosDoesNotThinFrames) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 8, 8);
  for (int t = 0; t < 20; ++t) {
    ASSERT_EQ(GST_FLOW_OK, stream.push(t));
    gst_harness_push_upstream_event(
        stream.harness(),
        gst_event_new_qos(GST_QOS_TYPE_UNDERFLOW, 9.0, GST_SECOND, 100 * GST_SECOND));
  }
  expect_frames(stream.take_all(), 0, 16);
  expect_frames(stream.take_to_end(), 16, 4);
}

}  // namespace
}  // namespace qdmd::test
