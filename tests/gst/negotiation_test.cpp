// SPDX-License-Identifier: LGPL-2.1-or-later
// Formats, strides, latency, limits, states.
#include <cmath>

#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

const GstVideoFormat kFormats[] = {
    GST_VIDEO_FORMAT_RGBx, GST_VIDEO_FORMAT_BGRx, GST_VIDEO_FORMAT_xRGB, GST_VIDEO_FORMAT_xBGR,
    GST_VIDEO_FORMAT_RGBA, GST_VIDEO_FORMAT_BGRA, GST_VIDEO_FORMAT_ARGB, GST_VIDEO_FORMAT_ABGR,
    GST_VIDEO_FORMAT_RGB,  GST_VIDEO_FORMAT_BGR};

// The pictures of a short clip, as RGB triples and alpha, so that formats can be compared.
std::vector<int> run_clip(const char* output, GstVideoFormat format, int width, int height,
                          bool padded) {
  Stream stream(std::string("qdmdbackground window-size=8 output=") + output, format, width,
                height);
  for (int t = 0; t < 8; ++t) {
    BufferPtr buffer;
    if (padded) {
      // Rows 32 bytes longer than the format asks for, the picture 64 bytes into the buffer.
      gsize offset[GST_VIDEO_MAX_PLANES] = {64};
      gint stride[GST_VIDEO_MAX_PLANES] = {GST_VIDEO_INFO_PLANE_STRIDE(&stream.info(), 0) + 32};
      buffer.reset(gst_buffer_new_allocate(
          nullptr, 64 + static_cast<gsize>(stride[0]) * static_cast<gsize>(height), nullptr));
      gst_buffer_memset(buffer.get(), 0, 0xa5, gst_buffer_get_size(buffer.get()));
      gst_buffer_add_video_meta_full(buffer.get(), GST_VIDEO_FRAME_FLAG_NONE, format,
                                     static_cast<guint>(width), static_cast<guint>(height), 1,
                                     offset, stride);
      stream.stamp(buffer.get(), t);
      stream.fill(buffer.get(), t, paint_mover);
    } else {
      buffer = stream.make_frame(t, paint_mover);
    }
    EXPECT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
  }
  std::vector<int> seen;
  for (const auto& buffer : stream.take_to_end())
    stream.each_pixel(buffer.get(), [&](int x, int, const uint8_t* p, int alpha) {
      seen.insert(seen.end(), p, p + 3);
      if (alpha < 0) return;
      const bool hidden = alpha == 0 && std::string(output) == "cutout";
      EXPECT_TRUE(hidden || alpha == Stream::alpha_at(x)) << alpha << " at " << x;
    });
  return seen;
}

// Upstream that likes the deepest formats best, as videotestsrc does.
TEST(Choice, IsOf8BitsWhereNobodyPrefersMore) {
  for (const char* element : {"qdmdbackground", "qdmdseparate"}) {
    GstElement* made = gst_element_factory_make(element, nullptr);
    GstPad* sink = gst_element_get_static_pad(made, "sink");
    const auto first_of = [&](const char* formats) {
      GstCaps* filter =
          gst_caps_from_string((std::string("video/x-raw,format=") + formats).c_str());
      GstCaps* caps = gst_caps_fixate(gst_pad_query_caps(sink, filter));
      const std::string first = gst_structure_get_string(gst_caps_get_structure(caps, 0), "format");
      gst_caps_unref(caps);
      gst_caps_unref(filter);
      return first;
    };
    EXPECT_EQ(first_of("{ARGB64,P010_10LE,RGBA,NV12}"), "RGBA") << element;
    EXPECT_EQ(first_of("{ARGB64,P010_10LE}"), "ARGB64") << element;
    gst_object_unref(sink);
    gst_object_unref(made);
  }
}

class Formats : public testing::TestWithParam<const char*> {};

TEST_P(Formats, AllGiveTheSamePicturesAtAnyWidthAndStride) {
  for (const auto& [width, height] : {std::pair{40, 24}, {33, 7}, {1, 1}, {3, 1}, {1, 5}}) {
    const auto expected = run_clip(GetParam(), GST_VIDEO_FORMAT_RGB, width, height, false);
    ASSERT_EQ(static_cast<size_t>(8 * 3 * width * height), expected.size());
    for (GstVideoFormat format : kFormats)
      for (bool padded : {false, true})
        EXPECT_EQ(expected, run_clip(GetParam(), format, width, height, padded))
            << gst_video_format_to_string(format) << " " << width << "x" << height
            << (padded ? " padded" : "");
  }
}

INSTANTIATE_TEST_SUITE_P(Outputs, Formats,
                         testing::Values("background", "foreground", "mask", "cutout"));

TEST(Outputs, BackgroundPlusForegroundExplainsTheFrame) {
  const auto background = run_clip("background", GST_VIDEO_FORMAT_RGB, 40, 24, false);
  const auto foreground = run_clip("foreground", GST_VIDEO_FORMAT_RGB, 40, 24, false);
  ASSERT_EQ(background.size(), foreground.size());
  size_t i = 0;
  for (int t = 0; t < 8; ++t)
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 40; ++x) {
        uint8_t rgb[3];
        paint_mover(t, x, y, rgb);
        for (int c = 0; c < 3; ++c, ++i) ASSERT_EQ(std::abs(rgb[c] - background[i]), foreground[i]);
      }
}

TEST(Outputs, CutoutIsTransparentOutsideTheMask) {
  Stream stream("qdmdbackground window-size=8 output=cutout", GST_VIDEO_FORMAT_BGRA, 40, 24);
  stream.push_many(0, 8);
  int shown = 0, hidden = 0;
  const auto out = stream.take_to_end();
  ASSERT_EQ(8u, out.size());
  for (const auto& buffer : out)
    stream.each_pixel(buffer.get(), [&](int, int, const uint8_t* p, int alpha) {
      if (alpha == 0) {
        ++hidden;
        EXPECT_EQ(0, p[0] + p[1] + p[2]);
      } else {
        ++shown;
      }
    });
  EXPECT_GT(shown, 0);
  EXPECT_GT(hidden, shown);
}

TEST(Outputs, ChangeWhilePlaying) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 40, 24);
  stream.push_many(0, 5);
  EXPECT_EQ(1u, stream.take_all().size());
  gst_harness_set(stream.harness(), "qdmdbackground", "output", 2, nullptr);
  stream.push_many(5, 5);
  // From the next frame that leaves, which waited.
  auto out = stream.take_all();
  ASSERT_EQ(5u, out.size());
  for (auto& buffer : stream.take_to_end()) out.push_back(std::move(buffer));
  ASSERT_EQ(9u, out.size());
  for (const auto& buffer : out)
    stream.each_pixel(buffer.get(), [](int, int, const uint8_t* p, int) {
      ASSERT_TRUE(p[0] == 0 || p[0] == 255);
    });
}

TEST(Latency, IsTheWindowLessOneFrame) {
  Stream stream("qdmdbackground window-size=25", GST_VIDEO_FORMAT_RGB, 8, 8, 50, 1);
  gst_harness_set_upstream_latency(stream.harness(), 10 * GST_MSECOND);
  stream.push(0);
  EXPECT_EQ(10 * GST_MSECOND + 24 * GST_SECOND / 50, gst_harness_query_latency(stream.harness()));
}

TEST(Latency, WithoutARateIsThatOf25FramesPerSecond) {
  Stream stream("qdmdbackground window-size=26", GST_VIDEO_FORMAT_RGB, 8, 8, 0, 1);
  stream.push(0);
  EXPECT_EQ(GST_SECOND, gst_harness_query_latency(stream.harness()));
}

TEST(Latency, OddRatesAreExact) {
  Stream stream("qdmdbackground window-size=31", GST_VIDEO_FORMAT_RGB, 8, 8, 30000, 1001);
  stream.push(0);
  EXPECT_EQ(GstClockTime{1001} * GST_MSECOND, gst_harness_query_latency(stream.harness()));
}

// What a pipeline says on its bus first: the error's text, or "" for EOS.
std::string first_word(const std::string& launch, GQuark* domain, int* code) {
  GstElement* pipeline = gst_parse_launch(launch.c_str(), nullptr);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, 60 * GST_SECOND, GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  std::string text = "nothing";
  if (message && GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS) text = "";
  if (message && GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
    GError* error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    text = error->message;
    *domain = error->domain;
    *code = error->code;
    g_error_free(error);
  }
  if (message) gst_message_unref(message);
  gst_object_unref(bus);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
  return text;
}

TEST(Limits, TooLargeAWindowIsAnErrorThatSaysWhatToChange) {
  GQuark domain = 0;
  int code = 0;
  const std::string text = first_word(
      "videotestsrc num-buffers=2 ! video/x-raw,format=RGB,width=4096,height=2160 ! "
      "qdmdbackground window-size=200 max-memory=100000000 ! fakesink",
      &domain, &code);
  EXPECT_EQ(GST_RESOURCE_ERROR, domain);
  EXPECT_EQ(GST_RESOURCE_ERROR_NO_SPACE_LEFT, code);
  EXPECT_NE(std::string::npos, text.find("window-size")) << text;
  EXPECT_NE(std::string::npos, text.find(std::to_string(3ull * 200 * 4096 * 2160))) << text;
}

TEST(Limits, AFolderThatCannotHaveTheWindowIsAnErrorThatSaysWhy) {
  GQuark domain = 0;
  int code = 0;
  const std::string text = first_word(
      "videotestsrc num-buffers=2 ! video/x-raw,format=RGB,width=64,height=48 ! "
      "qdmdbackground window-on-disk=/no/such/folder ! fakesink",
      &domain, &code);
  EXPECT_EQ(GST_RESOURCE_ERROR, domain);
  EXPECT_EQ(GST_RESOURCE_ERROR_OPEN_READ_WRITE, code);
  EXPECT_NE(std::string::npos, text.find("/no/such/folder")) << text;
  EXPECT_EQ("", first_word("videotestsrc num-buffers=30 ! "
                           "video/x-raw,format=RGB,width=64,height=48 ! qdmdbackground "
                           "window-size=8 window-on-disk=/tmp ! fakesink",
                           &domain, &code));
}

// What an element says whose sink pad is given caps by hand.
std::string said_of_caps(const std::string& launch, const std::string& text) {
  GstElement* element = gst_parse_launch(launch.c_str(), nullptr);
  GstBus* bus = gst_bus_new();
  gst_element_set_bus(element, bus);
  GstPad* sink = gst_element_get_static_pad(element, "sink");
  gst_element_set_state(element, GST_STATE_PAUSED);
  gst_pad_send_event(sink, gst_event_new_stream_start("limits"));
  GstCaps* caps = gst_caps_from_string(text.c_str());
  EXPECT_FALSE(gst_pad_send_event(sink, gst_event_new_caps(caps)));
  gst_caps_unref(caps);
  GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_ERROR);
  std::string said;
  if (message) {
    GError* error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    EXPECT_TRUE(g_error_matches(error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NO_SPACE_LEFT));
    said = error->message;
    g_error_free(error);
    gst_message_unref(message);
  }
  gst_element_set_state(element, GST_STATE_NULL);
  gst_element_set_bus(element, nullptr);
  gst_object_unref(bus);
  gst_object_unref(sink);
  gst_object_unref(element);
  return said;
}

TEST(Limits, BytesThatNoMachineHasAreRefusedWithTheCaps) {
  for (const char* size :
       {"width=8192,height=8192", "width=65536,height=65536", "width=2147483647,height=2147483647",
        "width=2147483647,height=1", "width=1,height=2147483647"})
    for (const char* element : {"qdmdbackground", "qdmdseparate"})
      for (const char* mode : {"batch", "live"})
        for (const char* format : {"RGB", "RGBA", "I420", "GRAY8"}) {
          const std::string said =
              said_of_caps(std::string(element) + " window-size=2048 mode=" + mode,
                           std::string("video/x-raw,framerate=25/1,format=") + format + "," + size);
          for (const char* word : {"window-size", "max-memory"})
            EXPECT_NE(std::string::npos, said.find(word))
                << element << " " << mode << " " << format << " " << size << ": " << said;
        }
}

// One lie of a buffer's metadata about where its planes are.
struct Lie {
  guint plane;
  gsize offset;  // bytes more
  gint stride;   // bytes more
  guint planes;  // fewer
  guint width;   // fewer
};

TEST(Limits, MetadataThatPointsOutsideOfItsBufferIsAnError) {
  const Lie lies[] = {{0, 0, 1, 0, 0},        {0, 1 << 20, 0, 0, 0}, {0, 0, G_MAXINT / 2, 0, 0},
                      {0, 0, G_MININT, 0, 0}, {0, 4, 0, 0, 0},       {0, 0, 0, 1, 0},
                      {0, 0, 0, 0, 1}};
  for (const char* launch : {"qdmdbackground window-size=2", "qdmdbackground mode=live"})
    for (GstVideoFormat format :
         {GST_VIDEO_FORMAT_RGB, GST_VIDEO_FORMAT_BGRA, GST_VIDEO_FORMAT_I420, GST_VIDEO_FORMAT_NV12,
          GST_VIDEO_FORMAT_YUY2})
      for (Lie lie : lies) {
        Stream stream(launch, format, 40, 24);
        // The last plane is the one that ends with the buffer.
        lie.plane = stream.info().finfo->n_planes - 1;
        gsize offset[GST_VIDEO_MAX_PLANES] = {};
        gint stride[GST_VIDEO_MAX_PLANES] = {};
        for (guint i = 0; i <= lie.plane; ++i) {
          offset[i] = stream.info().offset[i];
          stride[i] = stream.info().stride[i];
        }
        offset[lie.plane] += lie.offset;
        stride[lie.plane] += lie.stride;
        BufferPtr honest = make_bytes(stream.info(), 0), lying = make_bytes(stream.info(), 1);
        stream.stamp(honest.get(), 0);
        stream.stamp(lying.get(), 1);
        gst_buffer_add_video_meta_full(lying.get(), GST_VIDEO_FRAME_FLAG_NONE, format,
                                       40 - lie.width, 24, lie.plane + 1 - lie.planes, offset,
                                       stride);
        EXPECT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), honest.release()));
        EXPECT_EQ(GST_FLOW_ERROR, gst_harness_push(stream.harness(), lying.release()))
            << gst_video_format_to_string(format) << " offset +" << lie.offset << " stride +"
            << lie.stride << " planes -" << lie.planes << " width -" << lie.width;
      }
}

TEST(Limits, TheAdjointSolverRefusesWhatItCannotHold) {
  GQuark domain = 0;
  int code = 0;
  const std::string text = first_word(
      "videotestsrc num-buffers=2 ! video/x-raw,format=RGB,width=1920,height=1080 ! "
      "qdmdbackground method=qdmd window-size=100 solver=adjoint ! fakesink",
      &domain, &code);
  EXPECT_EQ(GST_RESOURCE_ERROR, domain);
  EXPECT_NE(std::string::npos, text.find("solver=gram")) << text;
}

TEST(Limits, InterlacedVideoIsRefusedWithTheWayOut) {
  for (GstVideoInterlaceMode mode :
       {GST_VIDEO_INTERLACE_MODE_INTERLEAVED, GST_VIDEO_INTERLACE_MODE_MIXED}) {
    Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 16, 16);
    stream.push_many(0, 3);
    GstElement* element = gst_harness_find_element(stream.harness(), "qdmdbackground");
    GstBus* bus = gst_bus_new();
    gst_element_set_bus(element, bus);
    GstVideoInfo info = stream.info();
    GST_VIDEO_INFO_INTERLACE_MODE(&info) = mode;
    gst_harness_set_src_caps(stream.harness(), gst_video_info_to_caps(&info));
    EXPECT_NE(GST_FLOW_OK, stream.push(3));
    const std::string text = next_text(bus, GST_MESSAGE_ERROR);
    EXPECT_NE(std::string::npos, text.find("deinterlace")) << text;
    EXPECT_EQ(3u, stream.take_all().size()) << "frames before are sent all the same";
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
    gst_object_unref(element);
  }
}

TEST(Limits, AHopLongerThanTheWindowIsNothingToABatch) {
  GQuark domain = 0;
  int code = 0;
  EXPECT_EQ("", first_word("videotestsrc num-buffers=9 ! qdmdbackground window-size=5 hop-size=6 ! "
                           "fakesink",
                           &domain, &code));
}

TEST(Pipelines, ALiveSourceEndsWithoutDroppingFrames) {
  GQuark domain = 0;
  int code = 0;
  EXPECT_EQ("", first_word("videotestsrc is-live=true num-buffers=30 ! "
                           "video/x-raw,format=RGB,width=64,height=48,framerate=50/1 ! "
                           "qdmdbackground window-size=8 ! fakesink sync=true",
                           &domain, &code));
}

TEST(States, WalkUpAndDown) {
  GstElement* element = gst_element_factory_make("qdmdbackground", nullptr);
  ASSERT_NE(nullptr, element);
  for (GstState state :
       {GST_STATE_READY, GST_STATE_PAUSED, GST_STATE_PLAYING, GST_STATE_PAUSED, GST_STATE_READY,
        GST_STATE_PAUSED, GST_STATE_READY, GST_STATE_NULL, GST_STATE_PLAYING, GST_STATE_NULL})
    EXPECT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element, state));
  gst_object_unref(element);
}

TEST(States, ReadyForgetsTheWindow) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 8, 8);
  stream.push_many(0, 4);
  GstElement* element = gst_harness_find_element(stream.harness(), "qdmdbackground");
  ASSERT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element, GST_STATE_READY));
  ASSERT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element, GST_STATE_PLAYING));
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  guint64 frames_in = 99;
  EXPECT_TRUE(gst_structure_get_uint64(stats, "frames-in", &frames_in));
  EXPECT_EQ(0u, frames_in);
  gst_structure_free(stats);
  gst_object_unref(element);
}

}  // namespace
}  // namespace qdmd::test
