// SPDX-License-Identifier: LGPL-2.1-or-later
// Files of real encoders through decodebin, without a conversion before the element.
#include <glib/gstdio.h>
#include <gst/gst.h>
#include <gst/video/video.h>
#include <gtest/gtest.h>

#include <string>

namespace {

constexpr int kFrames = 45;

bool has(const char* element) {
  GstElementFactory* factory = gst_element_factory_find(element);
  if (factory) gst_object_unref(factory);
  return factory != nullptr;
}

// The text of an error, or nothing.
std::string play(GstElement* pipeline) {
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, 100 * GST_SECOND, GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  gst_object_unref(bus);
  std::string text;
  if (!message) {
    text = "it did not end";
  } else if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
    GError* error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    text = error->message;
    g_error_free(error);
  }
  if (message) gst_message_unref(message);
  return text;
}

GstElement* parse(const std::string& launch) {
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(launch.c_str(), &error);
  if (error) {
    ADD_FAILURE() << error->message;
    g_error_free(error);
  }
  return pipeline;
}

void close(GstElement* pipeline) {
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

struct Codec {
  const char *name, *encoder, *elements, *format;
};

class Codecs : public testing::TestWithParam<Codec> {};

TEST_P(Codecs, PlayWithoutAConversion) {
  const Codec& codec = GetParam();
  for (const char* needed : {codec.encoder, "matroskamux", "decodebin"})
    if (!has(needed)) GTEST_SKIP() << "there is no " << needed;
  gchar* folder = g_dir_make_tmp("qdmd-codecs-XXXXXX", nullptr);
  ASSERT_NE(folder, nullptr);
  const std::string file = std::string(folder) + "/film.mkv";

  GstElement* maker = parse("qdmdscenesrc num-buffers=" + std::to_string(kFrames) +
                            " ! video/x-raw,width=322,height=242,format=" + codec.format + " ! " +
                            codec.elements + " ! matroskamux ! filesink location=" + file);
  ASSERT_NE(maker, nullptr);
  EXPECT_EQ(play(maker), "");
  close(maker);

  for (const char* properties : {"", "output=mask mode=live"}) {
    int frames = 0;
    GstElement* player =
        parse("filesrc location=" + file + " ! decodebin ! qdmdbackground " + "window-size=20 " +
              properties + " ! fakesink name=sink sync=false signal-handoffs=true");
    ASSERT_NE(player, nullptr);
    GstElement* sink = gst_bin_get_by_name(GST_BIN(player), "sink");
    g_signal_connect(sink, "handoff",
                     G_CALLBACK(+[](GstElement*, GstBuffer*, GstPad*, int* seen) { ++*seen; }),
                     &frames);
    GstPad* pad = gst_element_get_static_pad(sink, "sink");
    EXPECT_EQ(play(player), "");
    GstCaps* caps = gst_pad_get_current_caps(pad);
    GstVideoInfo info;
    EXPECT_TRUE(caps && gst_video_info_from_caps(&info, caps));
    if (caps) {
      EXPECT_STREQ(gst_video_format_to_string(GST_VIDEO_INFO_FORMAT(&info)), codec.format);
      gst_caps_unref(caps);
    }
    EXPECT_EQ(frames, kFrames);
    gst_object_unref(pad);
    gst_object_unref(sink);
    close(player);
  }
  g_remove(file.c_str());
  g_rmdir(folder);
  g_free(folder);
}

INSTANTIATE_TEST_SUITE_P(
    Encoders, Codecs,
    testing::Values(
        Codec{"x264", "x264enc", "x264enc speed-preset=ultrafast ! h264parse", "I420"},
        Codec{"x265", "x265enc", "x265enc speed-preset=ultrafast ! h265parse", "I420"},
        Codec{"x264_10", "x264enc", "x264enc speed-preset=ultrafast ! h264parse", "I420_10LE"},
        Codec{"x265_10", "x265enc", "x265enc speed-preset=ultrafast ! h265parse", "I420_10LE"}),
    [](const auto& codec) { return codec.param.name; });

}  // namespace
