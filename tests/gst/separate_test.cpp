// SPDX-License-Identifier: LGPL-2.1-or-later
// qdmdseparate: pads negotiate, come and go, and end, each by itself, whatever happens to others.
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <random>
#include <thread>

#include "tests/gst/many_pads.h"

namespace qdmd::test {
namespace {

const std::vector<std::string> kPads = {"background", "foreground", "mask", "cutout"};
constexpr const char* kSmall = " method=qdmd rank=1 window-size=6 hop-size=2";

TEST(SeparateCaps, MayHaveNoFramerate) {
  GstHarness* harness = gst_harness_new_with_padnames("qdmdseparate", "sink", "background");
  gst_harness_set_src_caps_str(harness, "video/x-raw,format=GRAY8,width=16,height=16");
  for (int t = 0; t < 5; ++t) {
    GstBuffer* buffer = gst_buffer_new_allocate(nullptr, 256, nullptr);
    gst_buffer_memset(buffer, 0, 9, 256);
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(t) * kFrame;
    EXPECT_EQ(GST_FLOW_OK, gst_harness_push(harness, buffer));
  }
  EXPECT_TRUE(gst_harness_push_event(harness, gst_event_new_eos()));
  EXPECT_EQ(5u, gst_harness_buffers_in_queue(harness));
  gst_harness_teardown(harness);
}

TEST(Memory, IsThatOfOneWindow) {
  const std::string options = std::string(kSmall) + " max-memory=";
  const auto starts = [&](const std::string& element, guint64 most, bool pads) {
    Rig rig(element + options + std::to_string(most));
    for (const auto& pad : kPads)
      if (pads) rig.listen(pad);
    if (!pads) rig.listen("src");
    rig.start(GST_VIDEO_FORMAT_RGB, 64, 48);
    GstMessage* error = gst_bus_pop_filtered(rig.bus(), GST_MESSAGE_ERROR);
    if (error) gst_message_unref(error);
    return !error;
  };
  guint64 least = 0;
  for (guint64 step = 1 << 24; step > 0; step /= 2)
    if (!starts("qdmdbackground", least + step, false)) least += step;
  EXPECT_GT(least, 6u * 3 * 64 * 48);
  EXPECT_FALSE(starts("qdmdseparate", least, true));
  EXPECT_TRUE(starts("qdmdseparate", least + 1, true));
}

// ---- Formats ------------------------------------------------------------------------------------

TEST(Formats, AMaskMayBeGreyBesideAnyPicture) {
  Rig rig(std::string("qdmdseparate shadows=foreground") + kSmall);
  rig.listen("background");
  rig.listen("mask", "video/x-raw,format=GRAY8");
  Rig luma(std::string("qdmdbackground output=mask shadows=foreground") + kSmall);
  luma.listen("src");
  for (Rig* one : {&rig, &luma}) {
    one->start(GST_VIDEO_FORMAT_I420, 30, 22);
    for (int t = 0; t < 12; ++t) ASSERT_EQ(GST_FLOW_OK, one->push(t));
  }
  const auto background = rig.at("background").take(), mask = rig.at("mask").take(),
             expected = luma.at("src").take();
  ASSERT_EQ(7u, mask.size());
  ASSERT_EQ(7u, background.size());
  ASSERT_EQ(7u, expected.size());
  EXPECT_NE(std::string::npos, background[0].caps.find("I420"));
  EXPECT_NE(std::string::npos, mask[0].caps.find("GRAY8"));
  size_t white = 0;
  for (size_t i = 0; i < mask.size(); ++i)
    for (size_t y = 0; y < 22; ++y)
      for (size_t x = 0; x < 30; ++x) {
        const uint8_t grey = mask[i].bytes[30 * y + x], level = expected[i].bytes[30 * y + x];
        ASSERT_EQ(level == 235 ? 255 : 0, grey) << i << " " << x << " " << y;
        white += grey == 255;
      }
  EXPECT_GT(white, 0u);
}

TEST(Formats, AGreyMaskOfDeepVideoHas8Bits) {
  Rig rig(std::string("qdmdseparate shadows=foreground") + kSmall);
  rig.listen("background", "video/x-raw,format=P010_10LE");
  rig.listen("mask", "video/x-raw,format=GRAY8");
  Rig luma(std::string("qdmdbackground output=mask shadows=foreground") + kSmall);
  luma.listen("src");
  for (Rig* one : {&rig, &luma}) {
    one->start(GST_VIDEO_FORMAT_I420_10LE, 30, 22);
    for (int t = 0; t < 12; ++t) ASSERT_EQ(GST_FLOW_OK, one->push(t));
  }
  const auto background = rig.at("background").take(), mask = rig.at("mask").take(),
             expected = luma.at("src").take();
  ASSERT_EQ(background.size(), mask.size());
  ASSERT_EQ(expected.size(), mask.size());
  ASSERT_FALSE(mask.empty());
  EXPECT_NE(std::string::npos, background[0].caps.find("P010_10LE"));
  size_t white = 0;
  for (size_t i = 0; i < mask.size(); ++i)
    for (size_t y = 0; y < 22; ++y)
      for (size_t x = 0; x < 30; ++x) {
        const int seen = mask[i].bytes[30 * y + x];
        const auto* word = expected[i].bytes.data() + 60 * y + 2 * x;
        ASSERT_EQ(seen == 255 ? 940 : 64, word[0] | word[1] << 8);
        ASSERT_TRUE(seen == 0 || seen == 255);
        white += seen == 255;
      }
  EXPECT_GT(white, 0u);
}

TEST(Formats, ACutOutMayBeTransparentWhereTheVideoIsNot) {
  Rig rig(std::string("qdmdseparate") + kSmall);
  rig.listen("mask");
  rig.listen("cutout", "video/x-raw,format=RGBA");
  rig.start(GST_VIDEO_FORMAT_RGB, 32, 20);
  for (int t = 0; t < 8; ++t) ASSERT_EQ(GST_FLOW_OK, rig.push(t));
  const auto mask = rig.at("mask").take(), cutout = rig.at("cutout").take();
  ASSERT_EQ(3u, cutout.size());
  for (size_t i = 0; i < 3; ++i)
    for (size_t p = 0; p < 32 * 20; ++p)
      ASSERT_EQ(mask[i].bytes[p], cutout[i].bytes[3 * 32 * 20 + p]) << i << " " << p;
}

TEST(Formats, DownstreamMayChangeItsMind) {
  Rig rig(std::string("qdmdseparate mode=live") + kSmall);
  rig.listen("background");
  rig.listen("mask");
  rig.start(GST_VIDEO_FORMAT_RGB, 32, 20);
  ASSERT_EQ(GST_FLOW_OK, rig.push(0));
  EXPECT_NE(std::string::npos, rig.at("mask").take()[0].caps.find("RGB"));
  // Another sink behind the same pad.
  rig.listen("mask", "video/x-raw,format=GRAY8");
  ASSERT_EQ(GST_FLOW_OK, rig.push(1));
  EXPECT_NE(std::string::npos, rig.at("mask").take()[0].caps.find("GRAY8"));
  EXPECT_EQ(2u, rig.at("background").take().size());
}

TEST(Formats, ThatDoNotFitAreAnErrorOfTheirPad) {
  Rig rig(std::string("qdmdseparate mode=live") + kSmall);
  rig.listen("background");
  rig.listen("foreground", "video/x-raw,format=I420");
  rig.start(GST_VIDEO_FORMAT_RGB, 32, 20);
  EXPECT_EQ(GST_FLOW_NOT_NEGOTIATED, rig.push(0));
  EXPECT_EQ(1u, rig.at("background").take().size());
  EXPECT_TRUE(rig.at("foreground").take().empty());
  rig.release("foreground");
  EXPECT_EQ(GST_FLOW_OK, rig.push(1));
  // Where the format is known, the link is refused.
  GstPad* pad = gst_element_request_pad_simple(rig.element(), "foreground");
  GstCaps* caps = gst_caps_from_string("video/x-raw,format=I420");
  EXPECT_FALSE(gst_pad_query_accept_caps(pad, caps));
  gst_caps_unref(caps);
  gst_object_unref(pad);
}

TEST(Formats, UpstreamIsToldWhatFitsAllPads) {
  Rig rig("qdmdseparate", false);
  rig.listen("mask", "video/x-raw,format=GRAY8");
  GstPad* sink = gst_element_get_static_pad(rig.element(), "sink");
  const auto has = [&](const char* text) {
    GstCaps* caps = gst_pad_query_caps(sink, nullptr);
    GstCaps* one = gst_caps_from_string(text);
    const bool can = gst_caps_can_intersect(caps, one);
    gst_caps_unref(one);
    gst_caps_unref(caps);
    return can;
  };
  EXPECT_TRUE(has("video/x-raw,format=RGB")) << "a grey mask asks for no grey video";
  rig.listen("background", "video/x-raw,format=NV12,width=320");
  EXPECT_TRUE(has("video/x-raw,format=I420,width=320"));
  EXPECT_FALSE(has("video/x-raw,format=I420,width=640"));
  EXPECT_FALSE(has("video/x-raw,format=RGB,width=320"));
  gst_object_unref(sink);
}

// ---- Pads ---------------------------------------------------------------------------------------

TEST(Pads, AreOneOfAKind) {
  Rig rig("qdmdseparate");
  for (const auto& name : kPads) {
    GstPadTemplate* its = gst_element_get_pad_template(rig.element(), name.c_str());
    ASSERT_TRUE(its) << name;
    GstPad* first = gst_element_request_pad(rig.element(), its, nullptr, nullptr);
    ASSERT_TRUE(first);
    EXPECT_STREQ(name.c_str(), GST_PAD_NAME(first));
    EXPECT_FALSE(gst_element_request_pad(rig.element(), its, nullptr, nullptr));
    gst_element_release_request_pad(rig.element(), first);
    gst_object_unref(first);
  }
}

TEST(Pads, ThatComeLateBeginWithTheStreamsEvents) {
  Rig rig(std::string("qdmdseparate") + kSmall);
  rig.listen("background");
  rig.start(GST_VIDEO_FORMAT_RGB, 16, 16);
  rig.send(gst_event_new_tag(gst_tag_list_new(GST_TAG_TITLE, "title", nullptr)));
  for (int t = 0; t < 8; ++t) ASSERT_EQ(GST_FLOW_OK, rig.push(t));
  rig.at("background").take_events();
  rig.listen("mask");
  ASSERT_EQ(GST_FLOW_OK, rig.push(8));
  EXPECT_EQ((std::vector<GstEventType>{GST_EVENT_STREAM_START, GST_EVENT_CAPS, GST_EVENT_SEGMENT,
                                       GST_EVENT_TAG}),
            rig.at("mask").take_events());
  EXPECT_TRUE(rig.at("background").take_events().empty());
  const auto mask = rig.at("mask").take();
  ASSERT_EQ(1u, mask.size());
  EXPECT_EQ(3u, mask[0].offset);
  EXPECT_NE(rig.at("mask").stream_id(), rig.at("background").stream_id());
}

TEST(Events, WaitWithTheFramesBeforeThem) {
  Rig rig(std::string("qdmdseparate") + kSmall);
  rig.listen("background");
  rig.listen("mask");
  rig.start(GST_VIDEO_FORMAT_RGB, 16, 16);
  ASSERT_EQ(GST_FLOW_OK, rig.push(0));
  rig.send(gst_event_new_tag(gst_tag_list_new(GST_TAG_TITLE, "title", nullptr)));
  const std::vector<GstEventType> tag = {GST_EVENT_TAG};
  size_t out = 0;
  for (const char* name : {"background", "mask"}) rig.at(name).take_events();
  for (int t = 1; out == 0; ++t) {
    ASSERT_LT(t, 100);
    ASSERT_EQ(GST_FLOW_OK, rig.push(t));
    out = rig.at("mask").take().size();
    for (const char* name : {"background", "mask"}) {
      const auto events = rig.at(name).take_events();
      EXPECT_EQ(out > 0 ? tag : std::vector<GstEventType>(), events) << name << t;
    }
  }
}

TEST(Events, ThatWaitReachAPadThatComesMeanwhileOnce) {
  Rig rig(std::string("qdmdseparate") + kSmall);
  rig.listen("background");
  rig.start(GST_VIDEO_FORMAT_RGB, 16, 16);
  ASSERT_EQ(GST_FLOW_OK, rig.push(0));
  for (const char* title : {"one", "two"})
    rig.send(gst_event_new_tag(gst_tag_list_new(GST_TAG_TITLE, title, nullptr)));
  rig.listen("mask");
  for (int t = 1; t < 8; ++t) ASSERT_EQ(GST_FLOW_OK, rig.push(t));
  EXPECT_EQ((std::vector<GstEventType>{GST_EVENT_STREAM_START, GST_EVENT_CAPS, GST_EVENT_SEGMENT,
                                       GST_EVENT_TAG, GST_EVENT_TAG}),
            rig.at("mask").take_events());
}

TEST(Events, OfTheWholeStreamSurviveAFlush) {
  Rig rig(std::string("qdmdseparate") + kSmall);
  rig.listen("background");
  rig.start(GST_VIDEO_FORMAT_RGB, 16, 16);
  ASSERT_EQ(GST_FLOW_OK, rig.push(0));
  rig.send(gst_event_new_tag(gst_tag_list_new(GST_TAG_TITLE, "title", nullptr)));
  rig.send(gst_event_new_flush_start());
  rig.send(gst_event_new_flush_stop(TRUE));
  rig.segment();
  for (int t = 0; t < 8; ++t) ASSERT_EQ(GST_FLOW_OK, rig.push(t));
  const auto events = rig.at("background").take_events();
  EXPECT_EQ(1, std::count(events.begin(), events.end(), GST_EVENT_TAG));
}

TEST(Events, ThatWaitComeBeforeAnotherStream) {
  Rig rig(std::string("qdmdseparate") + kSmall);
  rig.listen("background");
  rig.start(GST_VIDEO_FORMAT_RGB, 16, 16);
  ASSERT_EQ(GST_FLOW_OK, rig.push(0));
  rig.at("background").take_events();
  rig.send(gst_event_new_tag(gst_tag_list_new(GST_TAG_TITLE, "title", nullptr)));
  rig.send(gst_event_new_stream_start("another"));
  EXPECT_EQ((std::vector<GstEventType>{GST_EVENT_TAG, GST_EVENT_STREAM_START}),
            rig.at("background").take_events());
}

// Requested, and not linked before frames come.
TEST(Pads, ThatAreLinkedLateBeginWithTheStreamsEvents) {
  Rig rig(std::string("qdmdseparate mode=live") + kSmall);
  rig.listen("background");
  GstPad* mask = gst_element_request_pad_simple(rig.element(), "mask");
  rig.start(GST_VIDEO_FORMAT_I420, 16, 16);
  for (int t = 0; t < 3; ++t) ASSERT_EQ(GST_FLOW_OK, rig.push(t));
  rig.listen("mask", "video/x-raw,format=GRAY8");
  for (int t = 3; t < 5; ++t) ASSERT_EQ(GST_FLOW_OK, rig.push(t));
  EXPECT_EQ(2u, rig.at("mask").take().size());
  EXPECT_EQ(5u, rig.at("background").take().size());
  gst_object_unref(mask);
}

TEST(Pads, ServeAsManyRunsAsTheElementHas) {
  Rig rig(std::string("qdmdseparate") + kSmall, false);
  rig.listen("background");
  std::vector<Arrival> first[2];
  for (int run = 0; run < 3; ++run) {
    rig.set_state(run == 1 ? GST_STATE_PAUSED : GST_STATE_PLAYING);
    if (run == 1) rig.listen("mask");
    rig.start(GST_VIDEO_FORMAT_RGB, 20, 16);
    for (int t = 0; t < 9; ++t) ASSERT_EQ(GST_FLOW_OK, rig.push(t));
    rig.send(gst_event_new_eos());
    const auto background = rig.at("background").take();
    EXPECT_EQ(9u, background.size());
    if (run == 0) first[0] = background;
    EXPECT_EQ(first[0], background) << run;
    if (run == 1) first[1] = rig.at("mask").take();
    if (run == 2) {
      EXPECT_EQ(first[1], rig.at("mask").take());
    }
    rig.set_state(run == 1 ? GST_STATE_NULL : GST_STATE_READY);
    // As the source's pads would.
    rig.send(gst_event_new_flush_start());
    rig.send(gst_event_new_flush_stop(TRUE));
  }
}

int trials() { return std::getenv("QDMD_LONG") ? 1000 : 200; }

// Between any two frames.
TEST(Pads, ComeAndGoBetweenFrames) {
  for (const char* mode : {"batch", "live"}) {
    std::vector<Arrival> expected[4];
    const int count = trials();
    for (size_t k = 0; k < kPads.size(); ++k) {
      Rig alone("qdmdbackground output=" + kPads[k] + " mode=" + mode + kSmall);
      alone.listen("src");
      alone.start(GST_VIDEO_FORMAT_RGB, 16, 12);
      for (int t = 0; t < count; ++t) ASSERT_EQ(GST_FLOW_OK, alone.push(t));
      alone.send(gst_event_new_eos());
      expected[k] = alone.at("src").take();
    }
    Rig rig(std::string("qdmdseparate mode=") + mode + kSmall);
    std::mt19937 rng(23);
    rig.start(GST_VIDEO_FORMAT_RGB, 16, 12);
    size_t seen = 0;
    for (int t = 0; t < count; ++t) {
      const size_t k = rng() % kPads.size();
      if (rig.has(kPads[k]))
        rig.release(kPads[k]);
      else
        rig.listen(kPads[k]);
      bool any = false;
      for (const auto& pad : kPads) any |= rig.has(pad);
      const bool leaves = mode == std::string("live") || t >= 5;
      ASSERT_EQ(any || !leaves ? GST_FLOW_OK : GST_FLOW_NOT_LINKED, rig.push(t)) << t;
      for (size_t i = 0; i < kPads.size(); ++i) {
        if (!rig.has(kPads[i])) continue;
        const auto own = rig.at(kPads[i]).take();
        ASSERT_EQ(leaves ? 1u : 0u, own.size()) << kPads[i] << t;
        if (own.empty()) continue;
        const size_t frame = own[0].offset;
        ASSERT_EQ(static_cast<size_t>(leaves && mode[0] == 'l' ? t : t - 5), frame);
        // Masks learn from the frames that they decide: only those of a pad that stays are alike.
        if (i < 2) {
          ASSERT_TRUE(expected[i][frame] == own[0]) << kPads[i] << frame;
        }
        ++seen;
      }
    }
    EXPECT_GT(seen, static_cast<size_t>(count));
  }
}

// At any time, from another thread.
TEST(Pads, ComeAndGoWhileFramesPass) {
  Rig rig(std::string("qdmdseparate mode=live") + kSmall);
  rig.listen("background");
  rig.start(GST_VIDEO_FORMAT_RGB, 16, 12);
  std::atomic<bool> going = true;
  size_t pushed = 0;
  GstFlowReturn flow = GST_FLOW_OK;
  std::thread feeder([&] {
    while (going && flow == GST_FLOW_OK) flow = rig.push(static_cast<int>(pushed++));
  });
  std::mt19937 rng(24);
  size_t seen = 0;
  for (int i = 0; i < trials(); ++i) {
    const auto& name = kPads[1 + rng() % 3];
    if (rig.has(name)) {
      const auto own = rig.at(name).take();
      for (size_t k = 1; k < own.size(); ++k) ASSERT_EQ(own[k - 1].offset + 1, own[k].offset);
      seen += own.size();
      rig.release(name);
    } else {
      rig.listen(name);
    }
    if (rng() % 4 == 0) g_usleep(rng() % 2000);
  }
  going = false;
  feeder.join();
  EXPECT_EQ(GST_FLOW_OK, flow);
  EXPECT_GT(seen, 0u);
  const auto background = rig.at("background").take();
  ASSERT_EQ(pushed, background.size());
  for (size_t t = 0; t < pushed; ++t) ASSERT_EQ(t, background[t].offset);
}

// ---- Flows --------------------------------------------------------------------------------------

class Flows : public testing::TestWithParam<const char*> {};

TEST_P(Flows, OfOnePadAreNotTheOthersAffair) {
  for (const auto& [flow, combined] :
       {std::pair{GST_FLOW_EOS, GST_FLOW_OK}, std::pair{GST_FLOW_NOT_LINKED, GST_FLOW_OK},
        std::pair{GST_FLOW_ERROR, GST_FLOW_ERROR}, std::pair{GST_FLOW_FLUSHING, GST_FLOW_FLUSHING},
        std::pair{GST_FLOW_NOT_NEGOTIATED, GST_FLOW_NOT_NEGOTIATED}})
    for (const auto& odd : kPads) {
      SCOPED_TRACE(odd + " " + gst_flow_get_name(flow));
      Rig rig(std::string("qdmdseparate mode=") + GetParam() + kSmall);
      for (const auto& pad : kPads) rig.listen(pad);
      rig.start(GST_VIDEO_FORMAT_RGB, 16, 12);
      constexpr int kFrames = 20, kFrom = 9;
      for (int t = 0; t < kFrames; ++t) {
        if (t == kFrom) rig.at(odd).answer(flow);
        // Upstream goes on, whatever it is told; and time breaks.
        const guint flags = t == 15 ? guint(GST_BUFFER_FLAG_DISCONT) : 0;
        const GstFlowReturn got = rig.push(t, flags);
        if (t < kFrom || (t >= 15 && got == GST_FLOW_OK)) continue;
        EXPECT_EQ(combined, got) << t;
      }
      rig.send(gst_event_new_eos());
      for (const auto& pad : kPads) {
        const auto own = rig.at(pad).take();
        const size_t before = GetParam() == std::string("live") ? kFrom : kFrom - 5;
        if (pad == odd && flow == GST_FLOW_EOS)
          EXPECT_EQ(before + 1, own.size()) << "it wanted no more";
        else
          EXPECT_EQ(static_cast<size_t>(kFrames), own.size()) << pad;
        EXPECT_EQ(GST_EVENT_EOS, rig.at(pad).take_events().back());
      }
    }
}
INSTANTIATE_TEST_SUITE_P(Modes, Flows, testing::Values("batch", "live"));

TEST(Flow, OfAllThatHaveEndedIsTheEnd) {
  Rig rig(std::string("qdmdseparate mode=live") + kSmall);
  for (const auto& pad : kPads) rig.listen(pad).answer(GST_FLOW_EOS);
  rig.start(GST_VIDEO_FORMAT_RGB, 16, 12);
  EXPECT_EQ(GST_FLOW_EOS, rig.push(0));
  EXPECT_EQ(GST_FLOW_EOS, rig.push(1));
  // A flush opens them again.
  for (const auto& pad : kPads) rig.at(pad).answer(GST_FLOW_OK);
  rig.flush();
  EXPECT_EQ(GST_FLOW_OK, rig.push(2));
  for (const auto& pad : kPads) EXPECT_EQ(2u, rig.at(pad).take().size());
}

TEST(Flow, WithoutLinkedPadsIsNotLinked) {
  Rig rig(std::string("qdmdseparate mode=live") + kSmall);
  rig.start(GST_VIDEO_FORMAT_RGB, 16, 12);
  EXPECT_EQ(GST_FLOW_NOT_LINKED, rig.push(0));
  GstPad* pad = gst_element_request_pad_simple(rig.element(), "mask");
  EXPECT_EQ(GST_FLOW_NOT_LINKED, rig.push(1));
  gst_object_unref(pad);
  rig.listen("background");
  EXPECT_EQ(GST_FLOW_OK, rig.push(2));
  EXPECT_EQ(1u, rig.at("background").take().size());
}

// ---- Queries and events -------------------------------------------------------------------------

TEST(Queries, LatencyIsTheSameOnEachPad) {
  Rig rig("qdmdseparate window-size=20"), alone("qdmdbackground window-size=20");
  alone.listen("src");
  const auto latency = [](GstPad* pad) {
    GstQuery* query = gst_query_new_latency();
    GstClockTime min = 0;
    EXPECT_TRUE(gst_pad_query(pad, query));
    gst_query_parse_latency(query, nullptr, &min, nullptr);
    gst_query_unref(query);
    return min;
  };
  for (Rig* one : {&rig, &alone}) {
    // Upstream has none of its own.
    GstPad* sink = gst_element_get_static_pad(one->element(), "sink");
    GstPad* feed = gst_pad_get_peer(sink);
    gst_pad_set_query_function(feed,
                               [](GstPad* pad, GstObject* parent, GstQuery* query) -> gboolean {
                                 if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY)
                                   return gst_pad_query_default(pad, parent, query);
                                 gst_query_set_latency(query, TRUE, 0, GST_CLOCK_TIME_NONE);
                                 return TRUE;
                               });
    gst_object_unref(feed);
    gst_object_unref(sink);
    one->start(GST_VIDEO_FORMAT_RGB, 16, 12);
  }
  const GstClockTime expected = latency(alone.at("src").source());
  EXPECT_GE(expected, 19 * kFrame);
  for (const auto& pad : kPads) EXPECT_EQ(expected, latency(rig.listen(pad).source())) << pad;
}

TEST(Events, GoUpstreamFromEachPad) {
  Rig rig("qdmdseparate");
  GstPad* sink = gst_element_get_static_pad(rig.element(), "sink");
  GstPad* feed = gst_pad_get_peer(sink);
  int seeks = 0;
  gst_pad_set_element_private(feed, &seeks);
  gst_pad_set_event_function(feed, [](GstPad* pad, GstObject*, GstEvent* event) -> gboolean {
    if (GST_EVENT_TYPE(event) == GST_EVENT_SEEK)
      ++*static_cast<int*>(gst_pad_get_element_private(pad));
    gst_event_unref(event);
    return TRUE;
  });
  for (const auto& pad : kPads)
    EXPECT_TRUE(gst_pad_push_event(
        rig.listen(pad).pad(), gst_event_new_seek(1, GST_FORMAT_TIME, GST_SEEK_FLAG_NONE,
                                                  GST_SEEK_TYPE_SET, 0, GST_SEEK_TYPE_NONE, 0)));
  EXPECT_EQ(4, seeks);
  gst_object_unref(feed);
  gst_object_unref(sink);
}

TEST(Errors, AreThoseOfTheOtherElement) {
  Rig rig("qdmdseparate max-memory=1000");
  rig.listen("mask");
  rig.send(gst_event_new_stream_start("rig"));
  rig.set_caps(GST_VIDEO_FORMAT_RGB, 64, 48);
  rig.segment();
  GstMessage* message = gst_bus_pop_filtered(rig.bus(), GST_MESSAGE_ERROR);
  ASSERT_TRUE(message);
  GError* error = nullptr;
  gst_message_parse_error(message, &error, nullptr);
  EXPECT_TRUE(g_error_matches(error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NO_SPACE_LEFT));
  g_error_free(error);
  gst_message_unref(message);
  EXPECT_EQ(GST_FLOW_NOT_NEGOTIATED, rig.push(0));
}

// ---- Pipelines ----------------------------------------------------------------------------------

void expect_eos(const char* launch) {
  SCOPED_TRACE(launch);
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(launch, &error);
  ASSERT_TRUE(pipeline && !error) << (error ? error->message : "");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, 60 * GST_SECOND, GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  EXPECT_TRUE(message) << "it did not end";
  if (message) {
    EXPECT_EQ(GST_MESSAGE_EOS, GST_MESSAGE_TYPE(message));
    gst_message_unref(message);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(pipeline);
}

TEST(Pipelines, EndWithAQueueBehindEachPad) {
  expect_eos(
      "videotestsrc num-buffers=60 ! video/x-raw,width=32,height=24 ! qdmdseparate name=s "
      "window-size=10 s.background ! queue ! fakesink s.mask ! queue ! video/x-raw,format=GRAY8 ! "
      "fakesink s.cutout ! queue ! fakesink s.foreground ! queue ! fakesink");
  // One sink ends early.
  expect_eos(
      "videotestsrc num-buffers=60 ! video/x-raw,width=32,height=24 ! qdmdseparate name=s "
      "window-size=10 s.background ! queue ! identity eos-after=7 ! fakesink s.mask ! queue ! "
      "fakesink");
}

// The frames that wait in the element are on their way to the compositor beside it: the queue that
// goes around the element has room for them.
TEST(Pipelines, ThatMeetAgainEndWithAQueueForWhatWaits) {
  expect_eos(
      "videotestsrc num-buffers=60 ! video/x-raw,width=32,height=24,framerate=25/1 ! tee name=t "
      "t. ! queue max-size-buffers=0 max-size-bytes=0 max-size-time=4000000000 ! c.sink_0 "
      "t. ! queue ! qdmdseparate name=s window-size=50 "
      "s.background ! queue ! c.sink_1 s.mask ! queue ! c.sink_2 "
      "compositor name=c sink_1::xpos=32 sink_2::xpos=64 ! fakesink");
}

TEST(Pipelines, OfAllFourInOnePicture) {
  expect_eos(
      "videotestsrc num-buffers=30 ! video/x-raw,width=32,height=24,framerate=25/1 ! "
      "qdmdseparate name=s window-size=10 s.background ! queue ! c.sink_0 "
      "s.foreground ! queue ! c.sink_1 s.mask ! queue ! c.sink_2 s.cutout ! queue ! c.sink_3 "
      "compositor name=c sink_1::xpos=32 sink_2::ypos=24 sink_3::xpos=32 sink_3::ypos=24 ! "
      "fakesink");
}

}  // namespace
}  // namespace qdmd::test
