// SPDX-License-Identifier: LGPL-2.1-or-later
// What the element posts of its solves, of another scene, and of the spectrum.
#include <cmath>
#include <complex>

#include "tests/gst/watched_element.h"

namespace qdmd::test {
namespace {

TEST(Messages, OneForEachSolveWithTheFramesThatComeWithIt) {
  Stream stream("qdmdbackground window-size=8 post-messages=true", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  stream.push_many(0, 19);
  ASSERT_TRUE(stream.eos());
  const auto messages = element.messages();
  ASSERT_EQ(3u, messages.size());
  const GstClockTime begins[] = {0, 8 * kFrame, 16 * kFrame};
  const GstClockTime lasts[] = {8 * kFrame, 8 * kFrame, 3 * kFrame};
  for (size_t k = 0; k < 3; ++k) {
    const GstStructure* s = gst_message_get_structure(messages[k]);
    ASSERT_TRUE(gst_structure_has_name(s, "qdmdbackground"));
    EXPECT_EQ(GST_OBJECT(element.get()), GST_MESSAGE_SRC(messages[k]));
    guint64 timestamp = 0, stream_time = 0, running_time = 0, duration = 0;
    guint frames = 0, rank = 0;
    double real = 0, imaginary = 1, omega = -1, residual = -1, ratio = -1, time = -1;
    ASSERT_TRUE(gst_structure_get(
        s, "timestamp", G_TYPE_UINT64, &timestamp, "stream-time", G_TYPE_UINT64, &stream_time,
        "running-time", G_TYPE_UINT64, &running_time, "duration", G_TYPE_UINT64, &duration,
        "window-frames", G_TYPE_UINT, &frames, "rank", G_TYPE_UINT, &rank, "lambda-real",
        G_TYPE_DOUBLE, &real, "lambda-imaginary", G_TYPE_DOUBLE, &imaginary, "omega", G_TYPE_DOUBLE,
        &omega, "residual", G_TYPE_DOUBLE, &residual, "foreground-ratio", G_TYPE_DOUBLE, &ratio,
        "solve-time", G_TYPE_DOUBLE, &time, nullptr));
    EXPECT_EQ(begins[k], timestamp);
    EXPECT_EQ(begins[k], stream_time);
    EXPECT_EQ(begins[k], running_time);
    EXPECT_EQ(lasts[k], duration);
    EXPECT_EQ(8u, frames) << "a remainder is solved on the last window-size frames";
    EXPECT_EQ(1u, rank);
    EXPECT_NEAR(1, real, 0.05);
    EXPECT_NEAR(0, imaginary, 0.05);
    EXPECT_GE(omega, 0);
    EXPECT_GE(residual, 0);
    EXPECT_GT(ratio, 0);
    EXPECT_LT(ratio, 0.2);
    EXPECT_GT(time, 0);
    gst_message_unref(messages[k]);
  }
}

TEST(Messages, NoneWithoutBeingAskedAndAnyTime) {
  Stream stream("qdmdbackground window-size=4", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  stream.push_many(0, 4);
  EXPECT_TRUE(element.messages().empty());
  element.set("post-messages", TRUE);
  stream.push_many(4, 4);
  const auto messages = element.messages();
  ASSERT_EQ(1u, messages.size());
  gst_message_unref(messages[0]);
  element.set("post-messages", FALSE);
  stream.push_many(8, 4);
  EXPECT_TRUE(element.messages().empty());
}

TEST(Messages, HaveTheSpectrumThatIsAskedFor) {
  for (const bool asked : {false, true}) {
    Stream stream(std::string("qdmdbackground method=qdmd window-size=8 omega-threshold=0.1 "
                              "post-messages=true spectrum=") +
                      (asked ? "true" : "false"),
                  GST_VIDEO_FORMAT_RGB, 40, 24);
    Element element(stream);
    stream.push_many(0, 8);
    const auto messages = element.messages();
    ASSERT_EQ(1u, messages.size());
    const GstStructure* s = gst_message_get_structure(messages[0]);
    const char* const names[] = {"eigenvalues-real", "eigenvalues-imaginary", "amplitudes",
                                 "background"};
    for (const char* name : names) EXPECT_EQ(asked, gst_structure_has_field(s, name)) << name;
    if (asked) {
      const auto array = [&](const char* name) { return gst_structure_get_value(s, name); };
      const auto number = [&](const char* name, guint k) {
        return g_value_get_double(gst_value_array_get_value(array(name), k));
      };
      for (const char* name : names) ASSERT_EQ(7u, gst_value_array_get_size(array(name))) << name;
      // The nearest to the origin first, which the message is about.
      double real = 0, imaginary = 0, before = 0;
      guint background = 0, modes = 0;
      ASSERT_TRUE(gst_structure_get(s, "lambda-real", G_TYPE_DOUBLE, &real, "lambda-imaginary",
                                    G_TYPE_DOUBLE, &imaginary, nullptr));
      GstStructure* stats = nullptr;
      g_object_get(element.get(), "stats", &stats, nullptr);
      ASSERT_TRUE(gst_structure_get_uint(stats, "background-modes", &modes));
      for (const char* name : names)
        EXPECT_EQ(GST_VALUE_EQUAL,
                  gst_value_compare(array(name), gst_structure_get_value(stats, name)));
      gst_structure_free(stats);
      EXPECT_EQ(real, number(names[0], 0));
      EXPECT_EQ(imaginary, number(names[1], 0));
      for (guint k = 0; k < 7; ++k) {
        const std::complex<double> lambda(number(names[0], k), number(names[1], k));
        const double omega = std::abs(std::log(lambda));
        EXPECT_GE(omega, before) << k;
        before = omega;
        EXPECT_GE(lambda.imag(), 0) << k;
        EXPECT_GE(number(names[2], k), 0) << k;
        const bool chosen =
            g_value_get_boolean(gst_value_array_get_value(array(names[3]), k)) != FALSE;
        EXPECT_EQ(k == 0 || omega <= 0.1, chosen) << k;
        background += chosen;
      }
      EXPECT_EQ(modes, background);
      // The floor of the scene is far brighter than what moves before it.
      EXPECT_GT(number(names[2], 0), number(names[2], 6));
    }
    gst_message_unref(messages[0]);
  }
}

TEST(Messages, TimesFollowTheSegment) {
  Stream stream("qdmdbackground window-size=4 post-messages=true", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  segment.start = 10 * GST_SECOND;
  segment.time = 3 * GST_SECOND;
  segment.base = 5 * GST_SECOND;
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_segment(&segment)));
  stream.push_many(250, 4);
  const auto messages = element.messages();
  ASSERT_EQ(1u, messages.size());
  guint64 stream_time = 0, running_time = 0;
  gst_structure_get(gst_message_get_structure(messages[0]), "stream-time", G_TYPE_UINT64,
                    &stream_time, "running-time", G_TYPE_UINT64, &running_time, nullptr);
  EXPECT_EQ(3 * GST_SECOND, stream_time);
  EXPECT_EQ(5 * GST_SECOND, running_time);
  gst_message_unref(messages[0]);
}

TEST(Messages, OfAnotherScene) {
  for (const char* mode : {"batch", "live"}) {
    Stream stream(std::string("qdmdbackground window-size=20 mode=") + mode, GST_VIDEO_FORMAT_RGB,
                  96, 64);
    Element element(stream);
    const auto street = [](int t, int x, int y, uint8_t rgb[3]) {
      // Bars, and columns from frame 50 on.
      const int bar = (t < 50 ? x : y) / 8 % 2;
      for (int c = 0; c < 3; ++c) rgb[c] = static_cast<uint8_t>(60 + 90 * bar + 10 * c);
    };
    stream.push_many(0, 50, street);
    EXPECT_TRUE(element.messages().empty());
    stream.push_many(50, 30, street);
    const auto messages = element.messages();
    ASSERT_EQ(1u, messages.size()) << mode;
    const GstStructure* s = gst_message_get_structure(messages[0]);
    ASSERT_TRUE(gst_structure_has_name(s, "qdmdbackground-scene"));
    guint64 timestamp = 0, stream_time = 0, running_time = 0;
    ASSERT_TRUE(gst_structure_get(s, "timestamp", G_TYPE_UINT64, &timestamp, "stream-time",
                                  G_TYPE_UINT64, &stream_time, "running-time", G_TYPE_UINT64,
                                  &running_time, nullptr));
    EXPECT_EQ(57 * kFrame, timestamp);
    EXPECT_EQ(timestamp, stream_time);
    EXPECT_EQ(timestamp, running_time);
    gst_message_unref(messages[0]);
  }
}

// Bars, under a light that is looked for until a frame.
TEST(Messages, OfBeingReady) {
  for (const char* mode : {"batch", "live"})
    for (const int dark : {0, 40}) {
      Stream stream(std::string("qdmdbackground window-size=10 mode=") + mode, GST_VIDEO_FORMAT_RGB,
                    96, 64);
      Element element(stream);
      const auto street = [&](int t, int x, int, uint8_t rgb[3]) {
        const int bar = x / 8 % 2;
        for (int c = 0; c < 3; ++c)
          rgb[c] = static_cast<uint8_t>(t < dark ? 2 + 3 * bar : 60 + 90 * bar + 10 * c);
      };
      stream.push_many(0, 100, street);
      // Light after darkness is another scene, too.
      const auto messages = element.messages();
      EXPECT_TRUE(dark > 0 || messages.empty()) << mode;
      for (GstMessage* message : messages) gst_message_unref(message);
      ASSERT_EQ(1u, element.ready().size()) << mode << ' ' << dark;
      if (dark == 0)
        // Ten frames at rest, and four hops of two frames, of which calm solves leave out three.
        EXPECT_LE(element.ready()[0], (10 + 4 * 2) * kFrame) << mode;
      else
        EXPECT_GE(element.ready()[0], (dark - 10) * kFrame) << mode;
    }
}

}  // namespace
}  // namespace qdmd::test
