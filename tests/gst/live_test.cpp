// SPDX-License-Identifier: LGPL-2.1-or-later
// mode=live: no delay, one buffer out for each in, whatever happens to the stream; freeze, reset.
#include <cmath>
#include <string>

#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

// Plain Q-DMD, which solves so small a window at once with its frame.
constexpr const char* kLive = "qdmdbackground mode=live method=qdmd window-size=8 hop-size=3 ";

// An element of a stream, released at the end of its scope.
class Background {
 public:
  explicit Background(Stream& stream)
      : element_(gst_harness_find_element(stream.harness(), "qdmdbackground")) {}
  ~Background() { gst_object_unref(element_); }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  template <typename... Values>
  void set(const char* name, Values... values) {
    g_object_set(element_, name, values..., nullptr);
  }
  void reset() { g_signal_emit_by_name(element_, "reset"); }
  guint64 stat(const char* name) const {
    GstStructure* stats = nullptr;
    guint64 value = 0;
    g_object_get(element_, "stats", &stats, nullptr);
    EXPECT_TRUE(gst_structure_get_uint64(stats, name, &value)) << name;
    gst_structure_free(stats);
    return value;
  }

 private:
  GstElement* element_;
};

std::vector<uint8_t> bytes_of(GstBuffer* buffer) {
  std::vector<uint8_t> bytes(gst_buffer_get_size(buffer));
  EXPECT_EQ(bytes.size(), gst_buffer_extract(buffer, 0, bytes.data(), bytes.size()));
  return bytes;
}

// Pushes frame t; the one buffer that must be there at once.
BufferPtr push_one(Stream& stream, int t, const Painter& paint = paint_mover) {
  EXPECT_EQ(GST_FLOW_OK, stream.push(t, paint));
  auto out = stream.take_all();
  EXPECT_EQ(1u, out.size()) << "frame " << t;
  if (out.empty()) return nullptr;
  EXPECT_EQ(static_cast<GstClockTime>(t) * kFrame, GST_BUFFER_PTS(out[0].get()));
  EXPECT_EQ(kFrame, GST_BUFFER_DURATION(out[0].get()));
  EXPECT_EQ(static_cast<guint64>(t), GST_BUFFER_OFFSET(out[0].get()));
  return std::move(out[0]);
}

std::vector<uint8_t> frame_bytes(Stream& stream, int t, const Painter& paint = paint_mover) {
  return bytes_of(stream.make_frame(t, paint).get());
}

// Pixels apart by more than `most` levels in some channel.
int apart(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b, int most) {
  EXPECT_EQ(a.size(), b.size());
  int count = 0;
  for (size_t i = 0; i < a.size(); ++i) count += std::abs(a[i] - b[i]) > most;
  return count;
}

// ---- No delay, nothing lost ----

TEST(LiveLatency, IsThatOfUpstream) {
  for (const char* launch :
       {"qdmdbackground mode=live window-size=100", "qdmdbackground mode=live window-size=2"}) {
    Stream stream(launch, GST_VIDEO_FORMAT_RGB, 8, 8, 50, 1);
    gst_harness_set_upstream_latency(stream.harness(), 10 * GST_MSECOND);
    stream.push(0);
    EXPECT_EQ(10 * GST_MSECOND, gst_harness_query_latency(stream.harness()));
  }
}

TEST(LiveLatency, OfALiveSourceIsAddedToNothing) {
  GstQuery* queries[2];
  GstClockTime min[2], max[2];
  for (int k = 0; k < 2; ++k) {
    GstElement* pipeline = gst_parse_launch(
        k == 0
            ? "videotestsrc is-live=true ! video/x-raw,format=RGB,width=16,height=16,framerate=25/1"
              " ! fakesink sync=true"
            : "videotestsrc is-live=true ! video/x-raw,format=RGB,width=16,height=16,framerate=25/1"
              " ! qdmdbackground mode=live ! fakesink sync=true",
        nullptr);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    gst_element_get_state(pipeline, nullptr, nullptr, 60 * GST_SECOND);
    queries[k] = gst_query_new_latency();
    EXPECT_TRUE(gst_element_query(pipeline, queries[k]));
    gboolean live = FALSE;
    gst_query_parse_latency(queries[k], &live, &min[k], &max[k]);
    EXPECT_TRUE(live);
    gst_query_unref(queries[k]);
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
  EXPECT_EQ(min[0], min[1]);
  EXPECT_EQ(max[0], max[1]);
}

TEST(Live, EveryFrameComesOutAtOnceWithItsOwnTimeFlagsAndMetadata) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, 40, 24);
  for (int t = 0; t < 40; ++t) {
    auto buffer = stream.make_frame(t, paint_mover);
    if (t % 5 == 2) GST_BUFFER_FLAG_SET(buffer.get(), GST_BUFFER_FLAG_MARKER);
    gst_buffer_add_video_region_of_interest_meta(buffer.get(), "face", static_cast<guint>(t), 1, 2,
                                                 3);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
    const auto out = stream.take_all();
    ASSERT_EQ(1u, out.size()) << t;
    EXPECT_EQ(static_cast<GstClockTime>(t) * kFrame, GST_BUFFER_PTS(out[0].get()));
    EXPECT_EQ(static_cast<guint64>(t), GST_BUFFER_OFFSET(out[0].get()));
    EXPECT_EQ(t % 5 == 2, GST_BUFFER_FLAG_IS_SET(out[0].get(), GST_BUFFER_FLAG_MARKER)) << t;
    EXPECT_TRUE(t == 0 || !GST_BUFFER_IS_DISCONT(out[0].get())) << t;
    const auto* meta = reinterpret_cast<GstVideoRegionOfInterestMeta*>(
        gst_buffer_get_meta(out[0].get(), GST_VIDEO_REGION_OF_INTEREST_META_API_TYPE));
    ASSERT_NE(nullptr, meta) << t;
    EXPECT_EQ(static_cast<guint>(t), meta->x);
  }
  ASSERT_TRUE(stream.eos());
  EXPECT_TRUE(stream.take_all().empty()) << "nothing was waiting";
  Background element(stream);
  EXPECT_EQ(40u, element.stat("frames-in"));
  EXPECT_EQ(40u, element.stat("frames-out"));
  // Frames 1, 2, 3, 4, 6, and every third after it.
  EXPECT_EQ(16u, element.stat("solves"));
}

TEST(Live, AStillStreamComesBackFromTheFirstFrameOn) {
  for (int width : {1, 13})
    for (const char* options : {"", "method=dmd", "rank=1", "solver=qr", "solver=adjoint"}) {
      Stream stream(std::string(kLive) + options, GST_VIDEO_FORMAT_RGB, width, width);
      const auto still = frame_bytes(stream, 0, paint_still);
      for (int t = 0; t < 20; ++t) {
        const auto out = bytes_of(push_one(stream, t, paint_still).get());
        // Rows are padded to four bytes, which hold anything.
        const size_t row = static_cast<size_t>(GST_VIDEO_INFO_PLANE_STRIDE(&stream.info(), 0));
        for (int y = 0; y < width; ++y)
          for (int x = 0; x < 3 * width; ++x) {
            const size_t i = static_cast<size_t>(y) * row + static_cast<size_t>(x);
            ASSERT_EQ(still[i], out[i]) << options << ", frame " << t;
          }
      }
    }
}

TEST(Live, TheMoverIsForegroundOnceItIsKnown) {
  // The square covers a pixel for an eighth of the time, at most 3 of 20 frames: a ghost of at most
  // 3/20 of 260 levels. Less that, it is 114 levels away from any background.
  Stream stream(
      "qdmdbackground mode=live window-size=20 rank=1 output=mask foreground-threshold=80",
      GST_VIDEO_FORMAT_RGB, 40, 24);
  int inside = 0, outside = 0, shown = 0;
  for (int t = 0; t < 60; ++t) {
    const auto buffer = push_one(stream, t);
    if (t < 40) continue;
    const int left = (3 * t) % 32;
    stream.each_pixel(buffer.get(), [&](int x, int y, const uint8_t* p, int) {
      ASSERT_TRUE((p[0] == 0 || p[0] == 255) && p[1] == p[0] && p[2] == p[0]);
      const bool in = x >= left && x < left + 4 && y >= 4 && y < 9;
      if (in) ++shown;
      (in ? inside : outside) += p[0] == 255;
    });
  }
  EXPECT_EQ(shown, inside) << "all of the square";
  EXPECT_EQ(0, outside);
}

TEST(Live, OutputChangesWhilePlaying) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, 40, 24);
  Background element(stream);
  for (int t = 0; t < 10; ++t) push_one(stream, t);
  element.set("output", 2);
  stream.each_pixel(push_one(stream, 10).get(),
                    [](int, int, const uint8_t* p, int) { ASSERT_TRUE(p[0] == 0 || p[0] == 255); });
  element.set("foreground-threshold", 442.0);
  stream.each_pixel(push_one(stream, 11).get(),
                    [](int, int, const uint8_t* p, int) { ASSERT_EQ(0, p[0]); });
  element.set("output", 0);
  const auto background = bytes_of(push_one(stream, 12, paint_still).get());
  EXPECT_LT(apart(background, frame_bytes(stream, 0, paint_still), 100), 40 * 24 / 2);
}

// ---- freeze and reset ----

TEST(Freeze, KeepsThePictureWhilePlaying) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, 40, 24);
  Background element(stream);
  for (int t = 0; t < 12; ++t) push_one(stream, t);
  const guint64 solves = element.stat("solves");
  element.set("freeze", TRUE);
  const auto frozen = bytes_of(push_one(stream, 12).get());
  for (int t = 13; t < 25; ++t) EXPECT_EQ(frozen, bytes_of(push_one(stream, t).get())) << t;
  EXPECT_EQ(solves, element.stat("solves"));
  element.set("freeze", FALSE);
  for (int t = 25; t < 27; ++t) EXPECT_EQ(frozen, bytes_of(push_one(stream, t).get())) << t;
  EXPECT_NE(frozen, bytes_of(push_one(stream, 27).get())) << "the first hop is over";
  EXPECT_EQ(solves + 1, element.stat("solves"));
  EXPECT_EQ(28u, element.stat("frames-out"));
}

TEST(Freeze, InBatchFromTheNextWindowOn) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 40, 24);
  Background element(stream);
  stream.push_many(0, 7);
  EXPECT_EQ(1u, element.stat("solves"));
  element.set("freeze", TRUE);
  stream.push_many(7, 13);
  auto out = stream.take_all();
  ASSERT_EQ(16u, out.size());
  EXPECT_EQ(2u, element.stat("solves"));
  element.set("freeze", FALSE);
  stream.push_many(20, 4);
  EXPECT_EQ(2u, element.stat("solves"));
  stream.push_many(24, 1);
  EXPECT_EQ(3u, element.stat("solves"));
  for (auto& buffer : stream.take_all()) out.push_back(std::move(buffer));
  ASSERT_EQ(21u, out.size());
  for (size_t t = 0; t < 21; ++t) EXPECT_EQ(t * kFrame, GST_BUFFER_PTS(out[t].get()));
  const auto frozen = bytes_of(out[10].get());
  for (size_t t = 10; t < 20; ++t) EXPECT_EQ(frozen, bytes_of(out[t].get())) << t;
  ASSERT_TRUE(stream.eos());
  EXPECT_EQ(4u, stream.take_all().size());
  EXPECT_EQ(3u, element.stat("solves"));
}

const Painter kWhite = [](int, int, int, uint8_t* p) { p[0] = p[1] = p[2] = 255; };

TEST(Reset, StartsAnewInLive) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, 40, 24);
  Background element(stream);
  element.reset();
  for (int t = 0; t < 12; ++t) push_one(stream, t);
  // Another scene: without a reset its first frame meets the old background.
  element.reset();
  element.reset();
  for (int t = 12; t < 20; ++t)
    EXPECT_EQ(0,
              apart(bytes_of(push_one(stream, t, kWhite).get()), frame_bytes(stream, t, kWhite), 0))
        << t;
  EXPECT_EQ(20u, element.stat("frames-in"));
  EXPECT_EQ(20u, element.stat("frames-out"));
}

TEST(Reset, WithoutOneTheOldBackgroundStays) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, 40, 24);
  for (int t = 0; t < 12; ++t) push_one(stream, t);
  EXPECT_GT(
      apart(bytes_of(push_one(stream, 12, kWhite).get()), frame_bytes(stream, 12, kWhite), 20),
      1000);
}

TEST(Reset, EndsAFreezesPicture) {
  Stream stream(std::string(kLive) + "freeze=true", GST_VIDEO_FORMAT_RGB, 40, 24);
  Background element(stream);
  const auto first = bytes_of(push_one(stream, 0).get());
  EXPECT_EQ(first, bytes_of(push_one(stream, 1).get()));
  element.reset();
  // The wish stays: the next frame is the one that is kept.
  const auto next = bytes_of(push_one(stream, 2).get());
  EXPECT_EQ(0, apart(next, frame_bytes(stream, 2), 0));
  EXPECT_EQ(next, bytes_of(push_one(stream, 3).get()));
}

TEST(Reset, SendsWhatWaitsInABatchFirst) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 40, 24);
  Background element(stream);
  stream.push_many(0, 8);
  EXPECT_EQ(4u, stream.take_all().size());
  element.reset();
  EXPECT_TRUE(stream.take_all().empty()) << "not before the next frame";
  ASSERT_EQ(GST_FLOW_OK, stream.push(8, kWhite));
  auto out = stream.take_all();
  ASSERT_EQ(4u, out.size());
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ((4 + i) * kFrame, GST_BUFFER_PTS(out[i].get()));
  stream.push_many(9, 3, kWhite);
  EXPECT_TRUE(stream.take_all().empty()) << "a new window";
  stream.push_many(12, 1, kWhite);
  out = stream.take_all();
  ASSERT_EQ(1u, out.size());
  ASSERT_TRUE(stream.eos());
  for (auto& buffer : stream.take_all()) out.push_back(std::move(buffer));
  ASSERT_EQ(5u, out.size());
  for (size_t i = 0; i < 5; ++i) EXPECT_EQ((8 + i) * kFrame, GST_BUFFER_PTS(out[i].get()));
  for (const auto& buffer : out)
    EXPECT_EQ(0, apart(bytes_of(buffer.get()), frame_bytes(stream, 0, kWhite), 0));
}

TEST(Reset, AtTheEndOfAStreamIsHarmless) {
  for (const char* launch : {"qdmdbackground window-size=5", kLive}) {
    Stream stream(launch, GST_VIDEO_FORMAT_RGB, 8, 8);
    Background element(stream);
    stream.push_many(0, 3);
    element.reset();
    ASSERT_TRUE(stream.eos());
    EXPECT_EQ(3u, stream.take_all().size());
    element.reset();
  }
}

// ---- What happens to streams ----

TEST(LiveEvents, NoneOfThemLosesAFrame) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, 24, 16);
  Background element(stream);
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  int t = 0;
  for (int round = 0; round < 12; ++round) {
    for (int k = 0; k < 1 + round % 5; ++k) push_one(stream, t++);
    switch (round % 6) {
      case 0:
        ASSERT_TRUE(gst_harness_push_event(
            stream.harness(), gst_event_new_gap(static_cast<GstClockTime>(t) * kFrame, kFrame)));
        break;
      case 1: {
        auto buffer = stream.make_frame(t++, paint_mover);
        GST_BUFFER_FLAG_SET(buffer.get(), GST_BUFFER_FLAG_DISCONT);
        ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
        const auto out = stream.take_all();
        ASSERT_EQ(1u, out.size());
        EXPECT_TRUE(GST_BUFFER_IS_DISCONT(out[0].get()));
        break;
      }
      case 2:
        ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_segment(&segment)));
        break;
      case 3:
        ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_start()));
        ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_stop(TRUE)));
        ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_segment(&segment)));
        break;
      case 4:
        stream.set_caps(round % 4 ? GST_VIDEO_FORMAT_RGB : GST_VIDEO_FORMAT_BGRA, 24 + round, 9);
        break;
      case 5:
        element.reset();
        break;
    }
    EXPECT_TRUE(stream.take_all().empty()) << "round " << round;
  }
  push_one(stream, t++);
  ASSERT_TRUE(stream.eos());
  EXPECT_TRUE(stream.take_all().empty());
  EXPECT_EQ(static_cast<guint64>(t), element.stat("frames-in"));
  EXPECT_EQ(static_cast<guint64>(t), element.stat("frames-out"));
}

TEST(LiveEvents, AJumpBackInTimeKeepsTheBackgroundUntilThereIsAnother) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, 40, 24);
  Background element(stream);
  std::vector<uint8_t> last;
  for (int t = 100; t < 112; ++t) last = bytes_of(push_one(stream, t).get());
  const guint64 solves = element.stat("solves");
  std::vector<uint8_t> first;
  for (int t = 0; t < 3; ++t) {
    const auto bytes = bytes_of(push_one(stream, t).get());
    if (t == 0) {
      first = bytes;
      // As it was, to the rounding of a half.
      EXPECT_EQ(0, apart(bytes, last, 1));
    }
    EXPECT_EQ(t < 2, bytes == first) << t;
    EXPECT_EQ(solves + (t == 2), element.stat("solves")) << t;
  }
}

TEST(LiveEvents, FlushForgetsTheBackground) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, 40, 24);
  for (int t = 0; t < 12; ++t) push_one(stream, t);
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_start()));
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_stop(TRUE)));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_segment(&segment)));
  EXPECT_EQ(
      0, apart(bytes_of(push_one(stream, 50, kWhite).get()), frame_bytes(stream, 50, kWhite), 0));
}

// ---- Refusals ----

struct BusMessage {
  std::string text = "nothing";  // of an error; "" for EOS
  GQuark domain = 0;
  int code = 0;
};

// What a pipeline says first; `see` looks at it before it stops.
BusMessage first_message(
    const std::string& launch, const std::function<void(GstElement*)>& see = [](GstElement*) {}) {
  BusMessage result;
  GstElement* pipeline = gst_parse_launch(launch.c_str(), nullptr);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, 600 * GST_SECOND, GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  if (message && GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS) result.text = "";
  if (message && GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
    GError* error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    result = {error->message, error->domain, error->code};
    g_error_free(error);
  }
  if (message) gst_message_unref(message);
  see(pipeline);
  gst_object_unref(bus);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
  return result;
}

TEST(LiveLimits, AHopLongerThanTheWindowIsAnErrorThatSaysSo) {
  const auto message = first_message(
      "videotestsrc num-buffers=9 ! qdmdbackground mode=live window-size=5 hop-size=6 ! fakesink");
  EXPECT_EQ(GST_LIBRARY_ERROR, message.domain);
  EXPECT_EQ(GST_LIBRARY_ERROR_SETTINGS, message.code);
  EXPECT_NE(std::string::npos, message.text.find("hop-size")) << message.text;
  EXPECT_NE(std::string::npos, message.text.find("window-size")) << message.text;
  EXPECT_EQ("", first_message("videotestsrc num-buffers=9 ! qdmdbackground mode=live window-size=5 "
                              "hop-size=5 ! fakesink")
                    .text);
}

TEST(LiveLimits, TooLittleMemoryNamesTheBytes) {
  const auto message = first_message(
      "videotestsrc num-buffers=2 ! video/x-raw,format=RGB,width=4096,height=2160 ! "
      "qdmdbackground mode=live window-size=200 max-memory=1000000000 ! fakesink");
  EXPECT_EQ(GST_RESOURCE_ERROR, message.domain);
  EXPECT_EQ(GST_RESOURCE_ERROR_NO_SPACE_LEFT, message.code);
  for (const char* word : {"window-size", "200", "4096x2160", "1000000000", "max-memory"})
    EXPECT_NE(std::string::npos, message.text.find(word)) << word << " in " << message.text;
  // The window's frames, those that are remembered, and those that arrive during a solve.
  const size_t at = message.text.find("needs ");
  ASSERT_NE(std::string::npos, at) << message.text;
  const double bytes = std::stod(message.text.substr(at + 6)), window = 200.0 * 3 * 4096 * 2160;
  EXPECT_GE(bytes, window);
  EXPECT_LE(bytes, 1.7 * window);
}

// ---- In time ----

// Reports what was late, which depends on the machine, and checks what does not.
TEST(LivePipeline, OneHundredFramesASecondForTwoSeconds) {
  GstElementFactory* factory = gst_element_factory_find("fakevideosink");
  if (!factory) GTEST_SKIP() << "no fakevideosink";
  gst_object_unref(factory);
  const auto message = first_message(
      "videotestsrc is-live=true pattern=ball num-buffers=200 ! "
      "video/x-raw,format=RGB,width=320,height=240,framerate=100/1 ! "
      "qdmdbackground name=element mode=live window-size=60 ! fakevideosink name=end sync=true",
      [](GstElement* pipeline) {
        GstElement* element = gst_bin_get_by_name(GST_BIN(pipeline), "element");
        GstStructure* stats = nullptr;
        g_object_get(element, "stats", &stats, nullptr);
        guint64 in = 0, out = 0, solves = 0;
        gst_structure_get(stats, "frames-in", G_TYPE_UINT64, &in, "frames-out", G_TYPE_UINT64, &out,
                          "solves", G_TYPE_UINT64, &solves, nullptr);
        gst_structure_free(stats);
        EXPECT_EQ(200u, in);
        EXPECT_EQ(200u, out);
        EXPECT_GE(solves, 200u / 15);
        gst_object_unref(element);
        GstElement* end = gst_bin_get_by_name(GST_BIN(pipeline), "end");
        g_object_get(end, "stats", &stats, nullptr);
        guint64 dropped = 0, rendered = 0;
        gst_structure_get(stats, "dropped", G_TYPE_UINT64, &dropped, "rendered", G_TYPE_UINT64,
                          &rendered, nullptr);
        gst_structure_free(stats);
        gst_object_unref(end);
        EXPECT_EQ(200u, dropped + rendered);
        testing::Test::RecordProperty("dropped", static_cast<int>(dropped));
        g_print("dropped %d of 200 frames\n", static_cast<int>(dropped));
      });
  EXPECT_EQ("", message.text);
}

TEST(LiveProperties, AreReadBack) {
  GstElement* element = gst_element_factory_make("qdmdbackground", nullptr);
  gint mode = -1;
  guint hop = 99, step = 99;
  gboolean freeze = TRUE;
  g_object_get(element, "mode", &mode, "hop-size", &hop, "sample-step", &step, "freeze", &freeze,
               nullptr);
  EXPECT_EQ(0, mode);
  EXPECT_EQ(0u, hop);
  EXPECT_EQ(0u, step);
  EXPECT_FALSE(freeze);
  gst_util_set_object_arg(G_OBJECT(element), "mode", "live");
  gst_util_set_object_arg(G_OBJECT(element), "hop-size", "7");
  gst_util_set_object_arg(G_OBJECT(element), "sample-step", "3");
  gst_util_set_object_arg(G_OBJECT(element), "freeze", "true");
  g_object_get(element, "mode", &mode, "hop-size", &hop, "sample-step", &step, "freeze", &freeze,
               nullptr);
  EXPECT_EQ(1, mode);
  EXPECT_EQ(7u, hop);
  EXPECT_EQ(3u, step);
  EXPECT_TRUE(freeze);
  gst_object_unref(element);
}

}  // namespace
}  // namespace qdmd::test
