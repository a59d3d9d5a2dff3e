// SPDX-License-Identifier: LGPL-2.1-or-later
// What is no reason to forget: frames that are missing, clocks that are corrected, caps that say
// more of the same video. And what is one.
#include <algorithm>
#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "tests/gst/watched_element.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 64, kHeight = 48, kWindow = 20, kFrames = 140;
const std::vector<std::string> kModes = {"mode=live hop-size=5", "mode=batch"};
using Times = std::initializer_list<GstClockTime>;
using Pictures = std::vector<std::vector<uint8_t>>;

bool is_in_box(int x, int y) { return x >= 24 && x < 40 && y >= 16 && y < 32; }

// A wall, with noise, before which a box stands in frames `first` .. end - 1.
Painter street(int first, int end) {
  return [=](int t, int x, int y, uint8_t rgb[3]) {
    paint_still(t, x, y, rgb);
    const auto noise = [&](uint32_t c) {
      uint32_t bits = (uint32_t(t) * 3 + c) * uint32_t(kWidth * kHeight) + uint32_t(y * kWidth + x);
      bits = (bits ^ bits >> 15) * 2246822519u;
      return int((bits ^ bits >> 13) >> 8 & 3) - 1;
    };
    if (t >= first && t < end && is_in_box(x, y)) rgb[0] = 230, rgb[1] = 60, rgb[2] = 30;
    for (uint32_t c = 0; c < 3; ++c) rgb[c] = static_cast<uint8_t>(rgb[c] + noise(c));
  };
}

// The masks of a stream.
class Masks {
 public:
  explicit Masks(const std::string& properties, int rate = 25)
      : stream_(
            "qdmdbackground output=mask window-size=" + std::to_string(kWindow) + " " + properties,
            GST_VIDEO_FORMAT_RGB, kWidth, kHeight, rate) {}

  Stream& stream() { return stream_; }
  void send(GstEvent* event) { EXPECT_TRUE(gst_harness_push_event(stream_.harness(), event)); }
  // The same video, of which the caps say that, too. No other event comes with them.
  void say(const char* field, const char* value) {
    GstCaps* caps = gst_video_info_to_caps(&stream_.info());
    gst_structure_remove_field(gst_caps_get_structure(caps, 0), "colorimetry");
    GValue set = G_VALUE_INIT;
    g_value_init(&set,
                 std::string(field) == "framerate" || std::string(field) == "pixel-aspect-ratio"
                     ? GST_TYPE_FRACTION
                     : G_TYPE_STRING);
    EXPECT_TRUE(gst_value_deserialize(&set, value));
    gst_caps_set_value(caps, field, &set);
    g_value_unset(&set);
    send(gst_event_new_caps(caps));
    gst_caps_unref(caps);
  }
  void push(int t, const Painter& paint, GstClockTime time, bool discont = false) {
    BufferPtr buffer = stream_.make_frame(t, paint);
    GST_BUFFER_PTS(buffer.get()) = time;
    if (discont) GST_BUFFER_FLAG_SET(buffer.get(), GST_BUFFER_FLAG_DISCONT);
    times_.push_back(time);
    disconts_.push_back(discont);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream_.harness(), buffer.release()));
  }
  void push(int t, const Painter& paint) { push(t, paint, static_cast<GstClockTime>(t) * kFrame); }
  // All that came out, once the stream has ended: one for each frame, with its time and its flag.
  Pictures take() {
    const auto out = stream_.take_to_end();
    EXPECT_EQ(times_.size(), out.size());
    Pictures pictures;
    for (size_t t = 0; t < out.size(); ++t) {
      EXPECT_EQ(times_[t], GST_BUFFER_PTS(out[t].get())) << t;
      EXPECT_EQ(disconts_[t], static_cast<bool>(GST_BUFFER_IS_DISCONT(out[t].get()))) << t;
      std::vector<uint8_t> bytes(gst_buffer_get_size(out[t].get()));
      gst_buffer_extract(out[t].get(), 0, bytes.data(), bytes.size());
      pictures.push_back(std::move(bytes));
    }
    return pictures;
  }
  // Of each frame, which part of the box's place is white.
  std::vector<double> shares() {
    std::vector<double> all;
    for (const auto& picture : take()) {
      int white = 0, count = 0;
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          if (!is_in_box(x, y)) continue;
          ++count;
          white += picture[static_cast<size_t>(3 * (y * kWidth + x))] > 127;
        }
      all.push_back(double(white) / count);
    }
    return all;
  }

 private:
  Stream stream_;
  std::vector<GstClockTime> times_;
  std::vector<bool> disconts_;
};

double least(const std::vector<double>& shares, int from, int end) {
  return *std::min_element(shares.begin() + from, shares.begin() + end);
}
double most(const std::vector<double>& shares, int from, int end) {
  return *std::max_element(shares.begin() + from, shares.begin() + end);
}

// ---- Missing frames -----------------------------------------------------------------------------

// A box is taken away. time: of frame t.
Pictures of_a_box_that_leaves(
    const std::string& mode, const std::function<GstClockTime(int)>& time,
    const std::function<bool(int)>& discont = [](int) { return false; },
    const std::function<GstEvent*(int)>& event = [](int) { return nullptr; }) {
  // Frames that are an hour apart would be absorbed at once.
  Masks masks(mode + " absorb-time=0");
  for (int t = 0; t < kFrames; ++t) {
    if (GstEvent* before = event(t)) masks.send(before);
    masks.push(t, street(0, 40), time(t), discont(t));
  }
  return masks.take();
}
GstClockTime in_time(int t) { return static_cast<GstClockTime>(t) * kFrame; }

class Modes : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(GoingOn, Modes, testing::ValuesIn(kModes),
                         [](const auto& one) { return one.index == 0 ? "live" : "batch"; });

TEST_P(Modes, MasksAreTheSameWhereBuffersSayThatFramesAreMissing) {
  const Pictures expected = of_a_box_that_leaves(GetParam(), in_time);
  for (int every : {1, 3, 5, kWindow, 50})
    EXPECT_TRUE(expected == of_a_box_that_leaves(GetParam(), in_time,
                                                 [=](int t) { return t > 0 && t % every == 0; }))
        << every;
}

TEST_P(Modes, MasksAreTheSameWhereTimeStepsBackALittle) {
  const Pictures expected = of_a_box_that_leaves(GetParam(), in_time);
  for (int every : {2, 5, kWindow})
    for (GstClockTime back : Times{1, 4 * GST_MSECOND, 900 * GST_MSECOND}) {
      const auto time = [=](int t) {
        return 100 * GST_SECOND + in_time(t) -
               static_cast<GstClockTime>(t / every) * (kFrame + back);
      };
      EXPECT_TRUE(expected == of_a_box_that_leaves(GetParam(), time)) << every << " " << back;
    }
}

TEST_P(Modes, MasksAreTheSameWhereNoFrameCameForLong) {
  const Pictures expected = of_a_box_that_leaves(GetParam(), in_time);
  for (int every : {1, 5, 50})
    for (GstClockTime gap : Times{3 * kFrame, 2 * GST_SECOND, 3600 * GST_SECOND})
      EXPECT_TRUE(expected == of_a_box_that_leaves(
                                  GetParam(),
                                  [=](int t) {
                                    return in_time(t) + static_cast<GstClockTime>(t / every) * gap;
                                  }))
          << every << " " << gap;
}

TEST_P(Modes, MasksAreTheSameWhereShortGapEventsCome) {
  const Pictures expected = of_a_box_that_leaves(GetParam(), in_time);
  for (int every : {1, 5, kWindow})
    EXPECT_TRUE(expected == of_a_box_that_leaves(
                                GetParam(), in_time, [](int) { return false; },
                                [=](int t) -> GstEvent* {
                                  return t % every ? nullptr
                                                   : gst_event_new_gap(in_time(t), kFrame);
                                }))
        << every;
}

// A box that came stays what it is over whatever happens before frame 80.
void expect_kept(const std::string& mode, const std::function<void(Masks&)>& happens) {
  Masks masks(mode);
  for (int t = 0; t < kFrames; ++t) {
    if (t == 80) happens(masks);
    masks.push(t, street(50, kFrames), in_time(t));
  }
  const auto shares = masks.shares();
  EXPECT_LT(most(shares, kWindow, 50), 0.05);
  EXPECT_GT(least(shares, 55, kFrames), 0.95);
}

TEST_P(Modes, WhatCameStaysForegroundOverALongGap) {
  expect_kept(GetParam(),
              [](Masks& masks) { masks.send(gst_event_new_gap(in_time(80), 10 * GST_SECOND)); });
  expect_kept(GetParam(), [](Masks& masks) {
    masks.send(gst_event_new_gap(in_time(80), GST_CLOCK_TIME_NONE));
  });
}

// In live no frame waits, so nothing at all happens.
TEST(LongGap, ChangesNoMaskOfLive) {
  const Pictures expected = of_a_box_that_leaves(kModes[0], in_time);
  for (int every : {1, 5, 50})
    EXPECT_TRUE(expected == of_a_box_that_leaves(
                                kModes[0], in_time, [](int) { return false; },
                                [=](int t) -> GstEvent* {
                                  return t % every ? nullptr
                                                   : gst_event_new_gap(in_time(t), 10 * GST_SECOND);
                                }))
        << every;
}

// Sinks that wait for a frame need not wait for a window, whatever it is that comes in their place.
TEST(LongGap, SendsFramesThatWait) {
  for (GstClockTime length : Times{GST_CLOCK_TIME_NONE, 2 * GST_SECOND, kFrame}) {
    Masks masks("");
    for (int t = 0; t < 8; ++t) masks.push(t, street(0, 0));
    size_t left = 0;
    for (int i = 0; i < 100 && left == 0; ++i) {
      EXPECT_TRUE(i == 0 || length == kFrame);
      masks.send(gst_event_new_gap(in_time(8 + i), length));
      left = masks.stream().take_all().size();
      if (length == kFrame && i < 10) {
        EXPECT_EQ(0u, left);
      }
    }
    EXPECT_EQ(8u, left) << length;
  }
}

// A picture every ten seconds that calls itself 25 a second has windows, and a latency, too.
// Frames of fast-forward, and those of which only key units come, are further apart than the caps
// say: nobody is told to mend the framerate.
TEST(Playback, FastForwardAndKeyUnitsAreNoReasonToWarn) {
  for (const std::string& mode : kModes)
    for (const double rate : {1.0, 8.0, -4.0})
      for (const guint flags :
           {0u, guint(GST_SEGMENT_FLAG_TRICKMODE), guint(GST_SEGMENT_FLAG_TRICKMODE_KEY_UNITS)}) {
        SCOPED_TRACE(mode + " " + std::to_string(rate) + " " + std::to_string(flags));
        Masks masks(mode);
        Element element(masks.stream());
        GstSegment segment;
        gst_segment_init(&segment, GST_FORMAT_TIME);
        segment.rate = rate;
        segment.flags = GstSegmentFlags(flags);
        segment.stop = 200 * GST_SECOND;
        masks.send(gst_event_new_segment(&segment));
        for (int t = 0; t < 30; ++t) {
          const auto apart = static_cast<GstClockTime>(2 * t) * GST_SECOND;
          masks.push(t, street(1000, 1000), rate < 0 ? 100 * GST_SECOND - apart : apart);
        }
        EXPECT_EQ(30u, masks.take().size());
        EXPECT_EQ("", element.warning());
      }
}

TEST(Framerate, ThatIsNotTrueFormsWindowsAllTheSame) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 16, 16);
  Element element(stream);
  for (int t = 0; t < 40; ++t) {
    BufferPtr frame = stream.make_frame(0, paint_mover);
    GST_BUFFER_PTS(frame.get()) = static_cast<GstClockTime>(t) * 10 * GST_SECOND;
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), frame.release()));
    EXPECT_EQ(t < 4 ? 0u : 1u, stream.take_all().size()) << t;
  }
  EXPECT_EQ("", element.warning());
  EXPECT_GE(gst_harness_query_latency(stream.harness()), 40 * GST_SECOND);
  EXPECT_LE(gst_harness_query_latency(stream.harness()), 60 * GST_SECOND);
}

// ---- Time that jumps back -----------------------------------------------------------------------

TEST(JumpBack, BeginsANewWindow) {
  Masks masks("mode=batch");
  for (int t = 0; t < 8; ++t) masks.push(t, street(0, 0), 100 * GST_SECOND + in_time(t));
  masks.push(8, street(0, 0), 100 * GST_SECOND + in_time(7) - GST_SECOND + 1);
  EXPECT_TRUE(masks.stream().take_all().empty()) << "less than a second";
  masks.push(9, street(0, 0), 99 * GST_SECOND + in_time(7) + 1 - GST_SECOND);
  EXPECT_EQ(9u, masks.stream().take_all().size());
}

TEST(JumpBack, BeginsANewWindowOfLive) {
  Stream stream("qdmdbackground mode=live window-size=20 hop-size=5", GST_VIDEO_FORMAT_RGB, kWidth,
                kHeight);
  Element element(stream);
  const auto push = [&](int t, GstClockTime time) {
    BufferPtr frame = stream.make_frame(t, street(0, 0));
    GST_BUFFER_PTS(frame.get()) = time;
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), frame.release()));
  };
  for (int t = 0; t < 28; ++t) push(t, 100 * GST_SECOND + in_time(t));
  const guint64 solves = element.solves();
  // Half a hop had passed; the new window has its first solve after a whole one.
  for (int t = 28; t < 32; ++t) push(t, in_time(t));
  EXPECT_EQ(solves, element.solves());
  for (int t = 32; t < 45; ++t) push(t, in_time(t));
  EXPECT_LT(solves, element.solves());
}

// ---- Caps ---------------------------------------------------------------------------------------

const std::pair<const char*, const char*> kSameVideo[] = {{"framerate", "25/2"},
                                                          {"framerate", "0/1"},
                                                          {"framerate", "60/1"},
                                                          {"pixel-aspect-ratio", "12/11"},
                                                          {"colorimetry", "sRGB"},
                                                          {"colorimetry", "1:1:16:1"},
                                                          {"content-light-level", "1000:200"},
                                                          {"interlace-mode", "progressive"},
                                                          {"chroma-site", "jpeg"}};

TEST_P(Modes, WhatCameStaysForegroundOverCapsOfTheSameVideo) {
  for (const auto& [field, value] : kSameVideo) {
    SCOPED_TRACE(std::string(field) + "=" + value);
    expect_kept(GetParam(), [&](Masks& masks) { masks.say(field, value); });
  }
}

// In live no frame waits, so nothing at all happens.
TEST(SameVideo, ChangesNoMaskOfLive) {
  const auto masks_of = [](int every) {
    Masks masks(kModes[0]);
    for (int t = 0; t < kFrames; ++t) {
      if (t % every == 0) masks.say("framerate", (t / every) % 2 ? "25/1" : "24/1");
      masks.push(t, street(0, 40));
    }
    return masks.take();
  };
  const Pictures expected = masks_of(kFrames);
  for (int every : {1, 5, 50}) EXPECT_TRUE(expected == masks_of(every)) << every;
}

TEST(SameVideo, SendsFramesThatWaitWithTheirOwnCaps) {
  Masks masks("mode=batch");
  for (int t = 0; t < 30; ++t) masks.push(t, street(0, 0));
  masks.stream().take_all();
  masks.say("pixel-aspect-ratio", "12/11");
  EXPECT_EQ(size_t(kWindow - 1), masks.stream().take_all().size());
  GstCaps* caps = gst_pad_get_current_caps(masks.stream().harness()->sinkpad);
  int n = 0, d = 0;
  EXPECT_TRUE(
      gst_structure_get_fraction(gst_caps_get_structure(caps, 0), "pixel-aspect-ratio", &n, &d));
  EXPECT_EQ(12, n);
  gst_caps_unref(caps);
}

// The window that ends early has the frames before it.
TEST(SameVideo, EndsAWindowThatHasFramesOfBeforeTheCaps) {
  Stream stream("qdmdbackground method=qdmd window-size=8", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  stream.push_many(0, 16);
  const guint64 solves = element.solves();
  GstCaps* caps = gst_video_info_to_caps(&stream.info());
  for (int rate : {50, 25, 50}) {
    gst_caps_set_simple(caps, "framerate", GST_TYPE_FRACTION, rate, 1, nullptr);
    ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_caps(caps)));
    caps = gst_caps_make_writable(caps);
    stream.push_many(16, 1);
  }
  gst_caps_unref(caps);
  stream.eos();
  EXPECT_EQ(solves + 3, element.solves());
  GstStructure* stats = nullptr;
  g_object_get(element.get(), "stats", &stats, nullptr);
  guint rank = 0;
  EXPECT_TRUE(gst_structure_get_uint(stats, "rank", &rank));
  EXPECT_GT(rank, 1u) << "of one frame it is 1";
  gst_structure_free(stats);
}

// What stands in the first window of what begins anew is background.
void expect_forgotten(const std::string& mode, const std::function<void(Masks&)>& happens) {
  Masks masks(mode);
  for (int t = 0; t < 80; ++t) masks.push(t, street(50, kFrames));
  happens(masks);
  for (int t = 80; t < kFrames; ++t) masks.push(t, street(50, kFrames));
  const auto shares = masks.shares();
  EXPECT_GT(least(shares, 55, 80), 0.95);
  EXPECT_LT(most(shares, 85, kFrames), 0.05);
}

TEST_P(Modes, BlackAndWhiteOfAnotherLevelBeginAnew) {
  expect_forgotten(GetParam(), [](Masks& masks) { masks.say("colorimetry", "2:1:0:0"); });
}

TEST_P(Modes, AnotherFormatBeginsAnew) {
  expect_forgotten(GetParam(), [](Masks& masks) {
    masks.stream().set_caps(GST_VIDEO_FORMAT_BGR, kWidth, kHeight);
  });
}

TEST_P(Modes, AnotherSizeBeginsAnewAlsoOnTheWayBack) {
  expect_forgotten(GetParam(), [](Masks& masks) {
    masks.stream().set_caps(GST_VIDEO_FORMAT_RGB, kWidth, kHeight + 2);
    masks.stream().set_caps(GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  });
}

TEST_P(Modes, FlushesAndResetsBeginAnew) {
  expect_forgotten(GetParam(), [](Masks& masks) {
    Element element(masks.stream());
    g_signal_emit_by_name(element.get(), "reset");
  });
}

// A property that waits for the next caps has waited for these.
TEST(SameVideo, HasTheWindowThatWasAskedFor) {
  Stream stream("qdmdbackground window-size=20", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  stream.push_many(0, 3);
  element.set("window-size", 4);
  EXPECT_NE("", element.warning());
  GstCaps* caps = gst_video_info_to_caps(&stream.info());
  gst_caps_set_simple(caps, "framerate", GST_TYPE_FRACTION, 50, 1, nullptr);
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_caps(caps)));
  gst_caps_unref(caps);
  EXPECT_EQ(3u, stream.take_all().size());
  stream.push_many(3, 3);
  EXPECT_TRUE(stream.take_all().empty());
  stream.push_many(6, 1);
  EXPECT_EQ(1u, stream.take_all().size());
}

TEST(SameVideo, HasTheLatencyOfItsOwnRate) {
  Masks masks("mode=batch");
  const GstClockTime before = gst_harness_query_latency(masks.stream().harness());
  masks.say("framerate", "50/1");
  EXPECT_EQ(before / 2, gst_harness_query_latency(masks.stream().harness()));
}

// Of frames without timestamps the caps say how many come in a second.
TEST(SameVideo, HasTheAbsorbTimeOfItsOwnRate) {
  const auto foreground = [](int first_rate, const char* rate) {
    Masks masks("mode=live hop-size=5 absorb-time=1", first_rate);
    for (int t = 0; t < kFrames; ++t) {
      if (t == 30) masks.say("framerate", rate);
      masks.push(t, street(40, kFrames), GST_CLOCK_TIME_NONE);
    }
    const auto shares = masks.shares();
    return std::count_if(shares.begin() + 40, shares.end(), [](double s) { return s > 0.5; });
  };
  const auto slow = foreground(50, "25/1"), fast = foreground(25, "50/1");
  EXPECT_GT(slow, 20);
  EXPECT_GT(fast, slow + 20);
  EXPECT_EQ(slow, foreground(25, "25/1"));
  EXPECT_EQ(fast, foreground(50, "50/1"));
}

// ---- What is wished of pictures -----------------------------------------------------------------

// A wall along which a shadow runs.
void paint_shadow(int t, int x, int y, uint8_t rgb[3]) {
  street(0, 0)(t, x, y, rgb);
  if ((x + 11 * t) % kWidth < kWidth / 3)
    for (int c = 0; c < 3; ++c) rgb[c] = static_cast<uint8_t>(rgb[c] * 7 / 10);
}

// After a flush, which forgets all but wishes, the same frames have the same masks.
TEST(FirstWindow, KnowsWhatShadowsAreBeforeItsFirstFrameLeaves) {
  for (const char* shadows : {"background", "marked", "foreground"}) {
    Stream stream("qdmdbackground output=mask window-size=48 shadows=" + std::string(shadows),
                  GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
    const auto masks = [&] {
      stream.push_many(0, 96, paint_shadow);
      std::vector<std::vector<uint8_t>> all;
      for (const BufferPtr& buffer : stream.take_all()) {
        all.emplace_back(gst_buffer_get_size(buffer.get()));
        gst_buffer_extract(buffer.get(), 0, all.back().data(), all.back().size());
      }
      return all;
    };
    const auto first = masks();
    EXPECT_GE(first.size(), 30u);
    ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_start()));
    ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_stop(TRUE)));
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_segment(&segment)));
    EXPECT_TRUE(first == masks()) << shadows;
  }
}

}  // namespace
}  // namespace qdmd::test
