// SPDX-License-Identifier: LGPL-2.1-or-later
// qdmdscenesrc in pipelines: frames, truth, formats, seeks, ends, errors.
#include <gst/check/gstharness.h>
#include <gst/video/video.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace {

constexpr GstClockTime kFrame = GST_SECOND / 25;

struct Frame {
  GstClockTime pts, duration;
  guint64 offset;
  GstVideoInfo info;
  std::vector<uint8_t> rgb;     // width x height x 3
  std::vector<uint8_t> fourth;  // width x height where the format has four bytes a pixel
  // What formats of Y, U and V, and of grey, have: each component's samples, and all bytes.
  std::vector<std::vector<int>> components;
  std::vector<uint8_t> bytes;
};
using Frames = std::vector<Frame>;

void unpack_components(GstBuffer* buffer, GstVideoFrame* frame, Frame* result) {
  for (guint c = 0; c < GST_VIDEO_FRAME_N_COMPONENTS(frame); ++c) {
    std::vector<int> samples;
    // V is two bytes behind U, and not one, as GStreamer 1.22 has it.
    const bool wrong = GST_VIDEO_FRAME_FORMAT(frame) == GST_VIDEO_FORMAT_P010_10LE &&
                       GST_VIDEO_FRAME_COMP_POFFSET(frame, c) == 1;
    for (int y = 0; y < GST_VIDEO_FRAME_COMP_HEIGHT(frame, c); ++y)
      for (int x = 0; x < GST_VIDEO_FRAME_COMP_WIDTH(frame, c); ++x) {
        const auto* from = static_cast<const uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(frame, c)) +
                           y * GST_VIDEO_FRAME_COMP_STRIDE(frame, c) +
                           x * GST_VIDEO_FRAME_COMP_PSTRIDE(frame, c) + wrong;
        const bool deep = GST_VIDEO_FRAME_COMP_DEPTH(frame, c) > 8;
        samples.push_back((deep ? GST_READ_UINT16_LE(from) : *from) >>
                          GST_VIDEO_FORMAT_INFO_SHIFT(frame->info.finfo, c));
      }
    result->components.push_back(std::move(samples));
  }
  result->bytes.resize(gst_buffer_get_size(buffer));
  gst_buffer_extract(buffer, 0, result->bytes.data(), result->bytes.size());
}

Frame unpack(GstBuffer* buffer, GstPad* pad) {
  Frame result{GST_BUFFER_PTS(buffer),
               GST_BUFFER_DURATION(buffer),
               GST_BUFFER_OFFSET(buffer),
               {},
               {},
               {},
               {},
               {}};
  GstCaps* caps = gst_pad_get_current_caps(pad);
  EXPECT_TRUE(gst_video_info_from_caps(&result.info, caps));
  gst_caps_unref(caps);
  GstVideoFrame frame;
  if (!gst_video_frame_map(&frame, &result.info, buffer, GST_MAP_READ)) {
    ADD_FAILURE() << "could not map";
    return result;
  }
  if (!GST_VIDEO_INFO_IS_RGB(&result.info)) {
    unpack_components(buffer, &frame, &result);
    gst_video_frame_unmap(&frame);
    return result;
  }
  const int step = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, 0);
  int fourth = 0 + 1 + 2 + 3;
  for (int c = 0; c < 3; ++c) fourth -= GST_VIDEO_FRAME_COMP_POFFSET(&frame, c);
  for (int y = 0; y < GST_VIDEO_FRAME_HEIGHT(&frame); ++y) {
    const auto* row = static_cast<const uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) +
                      y * GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0);
    for (int x = 0; x < GST_VIDEO_FRAME_WIDTH(&frame); ++x) {
      for (int c = 0; c < 3; ++c)
        result.rgb.push_back(row[x * step + GST_VIDEO_FRAME_COMP_POFFSET(&frame, c)]);
      if (step == 4) result.fourth.push_back(row[x * step + fourth]);
    }
  }
  gst_video_frame_unmap(&frame);
  return result;
}

// A pipeline of one branch that ends in a fakesink; its frames come out unpacked.
class Pipeline {
 public:
  explicit Pipeline(const std::string& launch) {
    GError* error = nullptr;
    pipeline_ = gst_parse_launch(
        (launch + " ! fakesink name=sink signal-handoffs=true sync=false").c_str(), &error);
    if (error) {
      ADD_FAILURE() << error->message;
      g_error_free(error);
    }
    GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline_), "sink");
    g_signal_connect(sink, "handoff", G_CALLBACK(handed), this);
    g_signal_connect(sink, "preroll-handoff", G_CALLBACK(prerolled), this);
    gst_object_unref(sink);
  }
  ~Pipeline() {
    gst_element_set_state(pipeline_, GST_STATE_NULL);
    gst_object_unref(pipeline_);
  }
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  GstElement* get() { return pipeline_; }
  bool pause() {
    gst_element_set_state(pipeline_, GST_STATE_PAUSED);
    return gst_element_get_state(pipeline_, nullptr, nullptr, 60 * GST_SECOND) ==
           GST_STATE_CHANGE_SUCCESS;
  }
  // Plays to the end; the text of an error, or nothing.
  std::string play() {
    gst_element_set_state(pipeline_, GST_STATE_PLAYING);
    GstBus* bus = gst_element_get_bus(pipeline_);
    GstMessage* message = gst_bus_timed_pop_filtered(
        bus, 60 * GST_SECOND, GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
    gst_object_unref(bus);
    std::string text;
    if (!message) return "it did not end";
    if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
      GError* error = nullptr;
      gst_message_parse_error(message, &error, nullptr);
      text = error->message;
      g_error_free(error);
    }
    gst_message_unref(message);
    return text;
  }
  Frames frames;
  Frames preroll;
  std::function<void(size_t)> on_frame;  // after so many

 private:
  static void handed(GstElement*, GstBuffer* buffer, GstPad* pad, gpointer user) {
    auto* self = static_cast<Pipeline*>(user);
    self->frames.push_back(unpack(buffer, pad));
    if (self->on_frame) self->on_frame(self->frames.size());
  }
  static void prerolled(GstElement*, GstBuffer* buffer, GstPad* pad, gpointer user) {
    static_cast<Pipeline*>(user)->preroll.push_back(unpack(buffer, pad));
  }
  GstElement* pipeline_;
};

Frames frames_of(const std::string& properties, const std::string& caps = "format=RGBx") {
  Pipeline pipeline("qdmdscenesrc " + properties + " ! video/x-raw," + caps);
  EXPECT_EQ(pipeline.play(), "");
  return std::move(pipeline.frames);
}

constexpr const char* kSmall = "format=RGB,width=96,height=64";

TEST(SceneSource, SeedDecidesTheBytes) {
  const Frames first = frames_of("seed=7 num-buffers=20", kSmall);
  const Frames second = frames_of("seed=7 num-buffers=20", kSmall);
  const Frames other = frames_of("seed=8 num-buffers=20", kSmall);
  ASSERT_EQ(first.size(), 20u);
  for (size_t t = 0; t < first.size(); ++t) {
    EXPECT_EQ(first[t].rgb, second[t].rgb) << t;
    EXPECT_NE(first[t].rgb, other[t].rgb) << t;
  }
}

TEST(SceneSource, DefaultsAreAModestPicture) {
  const Frames frames = frames_of("num-buffers=1");
  EXPECT_EQ(frames[0].info.width, 320);
  EXPECT_EQ(frames[0].info.height, 240);
  EXPECT_EQ(frames[0].info.fps_n, 25);
  EXPECT_EQ(frames[0].info.fps_d, 1);
}

TEST(SceneSource, WhereTheMaskIsBlackFrameAndTruthAreEqual) {
  const Frames frames = frames_of("seed=3 num-buffers=130");
  const Frames truths = frames_of("seed=3 num-buffers=130 truth=background");
  const Frames masks = frames_of("seed=3 num-buffers=130 truth=mask");
  size_t covered = 0, different = 0;
  for (size_t t = 0; t < frames.size(); ++t) {
    ASSERT_EQ(frames[t].pts, truths[t].pts);
    ASSERT_EQ(frames[t].pts, masks[t].pts);
    for (size_t i = 0; i < frames[t].rgb.size(); ++i) {
      ASSERT_TRUE(masks[t].rgb[i] == 0 || masks[t].rgb[i] == 255);
      if (masks[t].rgb[i] == 0) {
        ASSERT_EQ(frames[t].rgb[i], truths[t].rgb[i]) << "frame " << t << ", sample " << i;
      } else {
        ++covered;
        different += frames[t].rgb[i] != truths[t].rgb[i];
      }
    }
  }
  EXPECT_GT(covered, 100u * 1000u);
  EXPECT_GT(different, covered * 9 / 10);
}

TEST(SceneSource, LabelsAreTheMaskWithShadowsAndEdgesApart) {
  const std::string scene = "seed=3 num-buffers=60 scene=shadow,mirror,motion-blur truth=";
  const Frames masks = frames_of(scene + "mask"), labels = frames_of(scene + "labels");
  const Frames padded = frames_of(scene + "labels", "format=BGRx,width=320,height=240");
  ASSERT_EQ(labels.size(), masks.size());
  std::map<uint8_t, size_t> pixels;
  for (size_t t = 0; t < labels.size(); ++t) {
    ASSERT_EQ(labels[t].rgb, padded[t].rgb);
    for (size_t i = 0; i < labels[t].rgb.size(); ++i) {
      ++pixels[labels[t].rgb[i]];
      ASSERT_EQ(masks[t].rgb[i] == 255, labels[t].rgb[i] == 255);
      ASSERT_EQ(labels[t].rgb[i], labels[t].rgb[i - i % 3]);
    }
  }
  ASSERT_EQ(pixels.size(), 4u);
  for (const int label : {0, 50, 170, 255}) EXPECT_GT(pixels[static_cast<uint8_t>(label)], 3000u);
}

// Expects those colours as Y, U and V, a shared sample being the mean of its pixels.
void expect_colours(const Frame& rgb, const Frame& frame) {
  const GstVideoInfo& info = frame.info;
  double kr = 0, kb = 0;
  ASSERT_TRUE(gst_video_color_matrix_get_Kr_Kb(info.colorimetry.matrix, &kr, &kb));
  gint offset[GST_VIDEO_MAX_COMPONENTS], scale[GST_VIDEO_MAX_COMPONENTS];
  gst_video_color_range_offsets(info.colorimetry.range, info.finfo, offset, scale);
  for (size_t c = 0; c < frame.components.size(); ++c) {
    const int columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, c);
    const int rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, c);
    size_t i = 0;
    for (int top = 0; top < info.height; top += rows)
      for (int left = 0; left < info.width; left += columns) {
        double mean[3] = {}, count = 0;
        for (int y = top; y < std::min(top + rows, info.height); ++y)
          for (int x = left; x < std::min(left + columns, info.width); ++x, ++count)
            for (int k = 0; k < 3; ++k)
              mean[k] += rgb.rgb[static_cast<size_t>(3 * (y * info.width + x) + k)];
        for (double& sum : mean) sum /= 255 * count;
        const double luma = kr * mean[0] + (1 - kr - kb) * mean[1] + kb * mean[2];
        const double part = c == 0   ? luma
                            : c == 1 ? (mean[2] - luma) / (2 * (1 - kb))
                                     : (mean[0] - luma) / (2 * (1 - kr));
        // Rounded, but for weights that are rounded, too.
        ASSERT_NEAR(frame.components[c][i++], offset[c] + scale[c] * part, 0.52)
            << "component " << c << " at " << left << " " << top;
      }
  }
}

TEST(SceneSource, VideoFormatsHaveTheSameColours) {
  for (const char* size : {"width=33,height=17", "width=64,height=48", "width=1,height=1"}) {
    const Frames expected =
        frames_of("num-buffers=4 scene=noise", std::string("format=RGB,") + size);
    const Frames mask = frames_of("num-buffers=4 truth=mask", std::string("format=RGB,") + size);
    for (const char* format :
         {"I420", "NV12", "Y42B", "YUY2", "Y444", "I420_10LE", "P010_10LE", "GRAY8"})
      for (const char* colours : {"bt601", "bt709", "1:4:0:0"}) {
        // Grey has no matrix to choose.
        const bool grey = std::string(format) == "GRAY8";
        if (grey && std::string(colours) == "bt709") continue;
        SCOPED_TRACE(std::string(format) + " " + colours + " " + size);
        const std::string caps =
            std::string(size) + ",format=" + format + ",colorimetry=" + colours;
        const Frames frames = frames_of("num-buffers=4 scene=noise", caps);
        const Frames masks = frames_of("num-buffers=4 truth=mask", caps);
        const Frames again = frames_of("num-buffers=4 scene=noise", caps);
        ASSERT_EQ(frames.size(), expected.size());
        for (size_t t = 0; t < frames.size(); ++t) {
          expect_colours(expected[t], frames[t]);
          expect_colours(mask[t], masks[t]);
          EXPECT_EQ(frames[t].bytes, again[t].bytes);
          if (testing::Test::HasFailure()) return;
        }
      }
  }
}

TEST(SceneSource, EveryFormatHasTheSameColours) {
  const Frames expected =
      frames_of("num-buffers=40 scene=noise truth=none", "format=RGB,width=33,height=17");
  const Frames mask = frames_of("num-buffers=40 truth=mask", "format=RGB,width=33,height=17");
  for (const char* format :
       {"RGBx", "BGRx", "xRGB", "xBGR", "RGBA", "BGRA", "ARGB", "ABGR", "RGB", "BGR"}) {
    SCOPED_TRACE(format);
    const std::string caps = std::string("width=33,height=17,format=") + format;
    const Frames frames = frames_of("num-buffers=40 scene=noise", caps);
    const Frames masks = frames_of("num-buffers=40 truth=mask", caps);
    ASSERT_EQ(frames.size(), expected.size());
    for (size_t t = 0; t < frames.size(); ++t) {
      EXPECT_EQ(frames[t].rgb, expected[t].rgb);
      EXPECT_EQ(masks[t].rgb, mask[t].rgb);
      for (const auto* picture : {&frames[t], &masks[t]})
        for (const uint8_t alpha : picture->fourth) ASSERT_EQ(alpha, 255);
    }
  }
}

TEST(SceneSource, AnySize) {
  for (const char* caps : {"format=RGB,width=1,height=1", "format=RGB,width=2,height=301",
                           "format=BGRA,width=641,height=3"})
    for (const char* truth : {"none", "background", "mask", "labels"})
      EXPECT_EQ(frames_of(std::string("num-buffers=5 scene=storm truth=") + truth, caps).size(), 5u)
          << caps;
}

TEST(SceneSource, TimestampsFollowTheRate) {
  const Frames frames =
      frames_of("num-buffers=100", "format=RGB,width=8,height=8,framerate=30000/1001");
  for (size_t t = 0; t < frames.size(); ++t) {
    EXPECT_EQ(frames[t].pts, gst_util_uint64_scale(t, 1001 * GST_SECOND, 30000));
    EXPECT_EQ(frames[t].pts + frames[t].duration,
              gst_util_uint64_scale(t + 1, 1001 * GST_SECOND, 30000));
    EXPECT_EQ(frames[t].offset, t);
  }
}

TEST(SceneSource, SeekingGivesTheFrameThatPlayingGives) {
  const char* scene = "scene=noise,jitter,leaves,rain,clutter seed=5";
  const Frames played = frames_of(std::string(scene) + " num-buffers=80", kSmall);
  Pipeline pipeline(std::string("qdmdscenesrc ") + scene + " ! video/x-raw," + kSmall);
  ASSERT_TRUE(pipeline.pause());
  for (const int k : {60, 3, 79, 0, 41}) {
    // Anywhere in the time of the frame.
    const GstClockTime position = static_cast<GstClockTime>(k) * kFrame + (k % 3) * kFrame / 3;
    pipeline.preroll.clear();
    ASSERT_TRUE(gst_element_seek_simple(pipeline.get(), GST_FORMAT_TIME,
                                        GstSeekFlags(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
                                        gint64(position)));
    ASSERT_EQ(gst_element_get_state(pipeline.get(), nullptr, nullptr, 60 * GST_SECOND),
              GST_STATE_CHANGE_SUCCESS);
    ASSERT_FALSE(pipeline.preroll.empty());
    EXPECT_EQ(pipeline.preroll.back().pts, played[static_cast<size_t>(k)].pts);
    EXPECT_EQ(pipeline.preroll.back().rgb, played[static_cast<size_t>(k)].rgb) << k;
  }
}

TEST(SceneSource, PlaysASegmentForwardsAndBackwards) {
  const Frames played = frames_of("scene=noise num-buffers=30", kSmall);
  for (const double rate : {1.0, -1.0}) {
    Pipeline pipeline(std::string("qdmdscenesrc scene=noise ! video/x-raw,") + kSmall);
    ASSERT_TRUE(pipeline.pause());
    ASSERT_TRUE(gst_element_seek(pipeline.get(), rate, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                                 GST_SEEK_TYPE_SET, gint64(5 * kFrame), GST_SEEK_TYPE_SET,
                                 gint64(12 * kFrame)));
    EXPECT_EQ(pipeline.play(), "");
    ASSERT_EQ(pipeline.frames.size(), 7u) << rate;
    for (size_t i = 0; i < 7; ++i) {
      const size_t k = rate > 0 ? 5 + i : 11 - i;
      EXPECT_EQ(pipeline.frames[i].offset, k);
      EXPECT_EQ(pipeline.frames[i].rgb, played[k].rgb);
    }
  }
}

// Backwards, a seek without a stop begins at the scene's end; and seeks may count from there.
TEST(SceneSource, SeeksKnowTheEndOfTheScene) {
  constexpr auto kSet = GST_SEEK_TYPE_SET, kEnd = GST_SEEK_TYPE_END, kNone = GST_SEEK_TYPE_NONE;
  struct Seek {
    int times;      // one after another: from the second on, the first one's stop is the segment's
    bool in_ready;  // before caps are known
    double rate;
    GstSeekType start_type;
    int start;
    GstSeekType stop_type;
    int stop;
    size_t first, count;
  };
  for (const Seek& seek :
       {Seek{1, false, -1, kSet, 0, kNone, 0, 11, 12},
        Seek{2, false, -1, kSet, 0, kNone, 0, 11, 12}, Seek{1, true, -1, kSet, 0, kNone, 0, 11, 12},
        Seek{1, false, 1, kSet, 0, kEnd, -5, 0, 7}, Seek{2, false, 1, kEnd, -3, kNone, 0, 9, 3}}) {
    Pipeline pipeline(std::string("qdmdscenesrc name=source scene=length=12 ! video/x-raw,") +
                      kSmall);
    if (seek.in_ready)
      gst_element_set_state(pipeline.get(), GST_STATE_READY);
    else
      ASSERT_TRUE(pipeline.pause());
    GstElement* source = gst_bin_get_by_name(GST_BIN(pipeline.get()), "source");
    for (int time = 0; time < seek.times; ++time)
      EXPECT_TRUE(gst_element_seek(source, seek.rate, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                                   seek.start_type, seek.start * gint64(kFrame), seek.stop_type,
                                   seek.stop_type == kNone ? -1 : seek.stop * gint64(kFrame)));
    EXPECT_EQ(pipeline.play(), "");
    ASSERT_EQ(pipeline.frames.size(), seek.count) << seek.rate;
    EXPECT_EQ(pipeline.frames[0].offset, seek.first);
    GstPad* pad = gst_element_get_static_pad(source, "src");
    GstEvent* event = gst_pad_get_sticky_event(pad, GST_EVENT_SEGMENT, 0);
    ASSERT_NE(event, nullptr);
    const GstSegment* segment = nullptr;
    gst_event_parse_segment(event, &segment);
    if (seek.rate < 0) {
      EXPECT_EQ(segment->stop, 12 * kFrame) << seek.in_ready;
      // What sinks show first is shown at once.
      EXPECT_EQ(gst_segment_to_running_time(segment, GST_FORMAT_TIME, 12 * kFrame), 0u);
    }
    gst_event_unref(event);
    gst_object_unref(pad);
    gst_object_unref(source);
  }
}

TEST(SceneSource, ASceneWithALengthEnds) {
  Pipeline pipeline(std::string("qdmdscenesrc scene=length=12 ! video/x-raw,") + kSmall);
  ASSERT_TRUE(pipeline.pause());
  gint64 duration = 0;
  EXPECT_TRUE(gst_element_query_duration(pipeline.get(), GST_FORMAT_TIME, &duration));
  EXPECT_EQ(duration, gint64(12 * kFrame));
  EXPECT_EQ(pipeline.play(), "");
  EXPECT_EQ(pipeline.frames.size(), 12u);
}

TEST(SceneSource, AnEndlessSceneHasNoDuration) {
  Pipeline pipeline(std::string("qdmdscenesrc ! video/x-raw,") + kSmall);
  ASSERT_TRUE(pipeline.pause());
  gint64 duration = 0;
  if (gst_element_query_duration(pipeline.get(), GST_FORMAT_TIME, &duration)) {
    EXPECT_EQ(duration, -1);
  }
}

TEST(SceneSource, EffectsAddToTheScene) {
  const Frames one = frames_of("scene=noise=3,jitter=1.5 num-buffers=3", kSmall);
  const Frames two =
      frames_of("scene=noise=9 effects=\"jitter=1.5, noise=3\" num-buffers=3", kSmall);
  for (size_t t = 0; t < one.size(); ++t) EXPECT_EQ(one[t].rgb, two[t].rgb);
}

TEST(SceneSource, WrongTextsAreErrorsThatListWhatIsAllowed) {
  const struct {
    const char *properties, *names;
  } cases[] = {{"scene=haze", "jitter"},
               {"effects=haze", "illumination-changes"},
               {"effects=noise=loud", "from 0 to 60 levels"},
               {"effects=noise=-1", "from 0 to 60 levels"},
               {"effects=noise=2:colour=3", "gain"}};
  for (const auto& c : cases) {
    Pipeline pipeline(std::string("qdmdscenesrc ") + c.properties);
    EXPECT_NE(pipeline.play().find(c.names), std::string::npos) << c.properties;
    EXPECT_TRUE(pipeline.frames.empty());
  }
}

TEST(SceneSource, ANewSizeAndRateGoOnInTime) {
  Pipeline pipeline(
      "qdmdscenesrc num-buffers=20 ! capsfilter name=filter "
      "caps=video/x-raw,format=RGB,width=32,height=24,framerate=25/1");
  pipeline.on_frame = [&](size_t count) {
    if (count != 10) return;
    GstElement* filter = gst_bin_get_by_name(GST_BIN(pipeline.get()), "filter");
    GstCaps* caps =
        gst_caps_from_string("video/x-raw,format=RGB,width=48,height=24,framerate=50/1");
    g_object_set(filter, "caps", caps, nullptr);
    gst_caps_unref(caps);
    gst_object_unref(filter);
  };
  EXPECT_EQ(pipeline.play(), "");
  ASSERT_EQ(pipeline.frames.size(), 20u);
  EXPECT_EQ(pipeline.frames.front().info.width, 32);
  EXPECT_EQ(pipeline.frames.back().info.width, 48);
  EXPECT_EQ(pipeline.frames.back().duration, kFrame / 2);
  for (size_t t = 1; t < 20; ++t)
    EXPECT_EQ(pipeline.frames[t].pts, pipeline.frames[t - 1].pts + pipeline.frames[t - 1].duration);
}

TEST(SceneSource, LiveReportsOneFrameOfLatency) {
  Pipeline pipeline(
      std::string("qdmdscenesrc name=source is-live=true num-buffers=4 ! video/x-raw,") + kSmall);
  EXPECT_EQ(pipeline.play(), "");
  EXPECT_EQ(pipeline.frames.size(), 4u);
  GstQuery* query = gst_query_new_latency();
  GstElement* source = gst_bin_get_by_name(GST_BIN(pipeline.get()), "source");
  EXPECT_TRUE(gst_element_query(source, query));
  gst_object_unref(source);
  gboolean live = FALSE;
  GstClockTime least = 0;
  gst_query_parse_latency(query, &live, &least, nullptr);
  gst_query_unref(query);
  EXPECT_TRUE(live);
  EXPECT_EQ(least, kFrame);
}

// The scene and the separator together: the mover is gone, the still street is left.
TEST(SceneSource, QdmdbackgroundFindsTheTrueBackground) {
  const std::string caps = "video/x-raw,format=RGB,width=160,height=120";
  Pipeline separated("qdmdscenesrc scene=basic num-buffers=125 ! " + caps +
                     " ! qdmdbackground window-size=125 rank=1");
  EXPECT_EQ(separated.play(), "");
  const Frames input = frames_of("scene=basic num-buffers=125", "format=RGB,width=160,height=120");
  const Frames truth =
      frames_of("scene=basic num-buffers=125 truth=background", "format=RGB,width=160,height=120");
  ASSERT_EQ(separated.frames.size(), 125u);
  const auto error = [&](const Frames& frames, size_t t) {
    double sum = 0;
    for (size_t i = 0; i < truth[t].rgb.size(); ++i)
      sum += std::abs(frames[t].rgb[i] - truth[t].rgb[i]);
    return sum / static_cast<double>(truth[t].rgb.size());
  };
  // The mover covers a pixel for a tenth of the time at most, noise averages out.
  EXPECT_LT(error(separated.frames, 60), error(input, 60) / 2);
  EXPECT_LT(error(separated.frames, 60), 2);
}

}  // namespace
