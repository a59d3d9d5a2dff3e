// SPDX-License-Identifier: LGPL-2.1-or-later
// What becomes of a window when an event or a query arrives in its middle: one test a row.
#include <gst/video/gstvideometa.h>

#include <string>
#include <utility>

#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

constexpr int kWindow = 8;

// A stream that has just received three frames of a window.
class HalfAWindow : public testing::Test {
 protected:
  HalfAWindow() : stream_("qdmdbackground window-size=8", GST_VIDEO_FORMAT_RGB, 40, 24) {
    stream_.push_many(0, 3);
    EXPECT_TRUE(stream_.take_all().empty());
  }
  void send(GstEvent* event) { EXPECT_TRUE(gst_harness_push_event(stream_.harness(), event)); }
  // Frames `first` .. end - 1 came out and nothing else.
  void expect_frames(int first, int end) {
    const auto out = stream_.take_all();
    ASSERT_EQ(static_cast<size_t>(end - first), out.size());
    for (int t = first; t < end; ++t)
      EXPECT_EQ(static_cast<GstClockTime>(t) * kFrame,
                GST_BUFFER_PTS(out[static_cast<size_t>(t - first)].get()));
  }
  // A new window begins with frame `first`: it is full after kWindow frames, not before, and from
  // then on a frame leaves for each that comes. At the end, the rest.
  void expect_new_window(int first) {
    stream_.push_many(first, kWindow - 1);
    expect_frames(first, first);
    for (int t = first; t < first + kWindow + 3; ++t) {
      stream_.push_many(t + kWindow - 1, 1);
      expect_frames(t, t + 1);
    }
    expect_rest(first + kWindow + 3, first + 2 * kWindow + 2);
  }
  void expect_rest(int first, int end) {
    EXPECT_TRUE(stream_.eos());
    expect_frames(first, end);
  }
  static GstSegment segment_from(GstClockTime start, double rate = 1) {
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    segment.rate = rate;
    segment.start = segment.time = start;
    segment.stop = start + 1000 * GST_SECOND;
    return segment;
  }

  Stream stream_;
};

TEST_F(HalfAWindow, StreamStartSendsItAndForgetsTheBackground) {
  send(gst_event_new_stream_start("another"));
  expect_frames(0, 3);
  GstCaps* caps = gst_video_info_to_caps(&stream_.info());
  send(gst_event_new_caps(caps));
  gst_caps_unref(caps);
  const GstSegment segment = segment_from(0);
  send(gst_event_new_segment(&segment));
  expect_new_window(3);
}

TEST_F(HalfAWindow, SegmentSendsIt) {
  const GstSegment segment = segment_from(10 * GST_SECOND);
  send(gst_event_new_segment(&segment));
  expect_frames(0, 3);
  expect_new_window(250);
}

TEST_F(HalfAWindow, SegmentDoneSendsIt) {
  send(gst_event_new_segment_done(GST_FORMAT_TIME, 3 * kFrame));
  expect_frames(0, 3);
}

TEST_F(HalfAWindow, EosSendsIt) {
  ASSERT_TRUE(stream_.eos());
  expect_frames(0, 3);
}

TEST_F(HalfAWindow, ALongGapSendsItFirst) {
  send(gst_event_new_gap(3 * kFrame, 10 * GST_SECOND));
  expect_frames(0, 3);
  expect_new_window(253);
}

TEST_F(HalfAWindow, CapsOfAnotherSizeSendItFirst) {
  stream_.set_caps(GST_VIDEO_FORMAT_RGB, 16, 16);
  const auto out = stream_.take_all();
  ASSERT_EQ(3u, out.size());
  for (const auto& buffer : out) EXPECT_EQ(40u * 24 * 3, gst_buffer_get_size(buffer.get()));
}

// The caps are of the video that plays, and say more of it.
TEST_F(HalfAWindow, CapsThatSayMoreSendItFirst) {
  GstCaps* caps = gst_video_info_to_caps(&stream_.info());
  gst_caps_set_simple(caps, "content-light-level", G_TYPE_STRING, "1000:200", nullptr);
  send(gst_event_new_caps(caps));
  gst_caps_unref(caps);
  expect_frames(0, 3);
  expect_new_window(3);
}

TEST_F(HalfAWindow, EqualCapsLeaveItAsItIs) {
  GstCaps* caps = gst_video_info_to_caps(&stream_.info());
  send(gst_event_new_caps(caps));
  gst_caps_unref(caps);
  expect_frames(0, 0);
  stream_.push_many(3, kWindow - 3);
  expect_frames(0, 1);
}

TEST_F(HalfAWindow, DiscontLeavesItAsItIs) {
  for (int t = 3; t < kWindow; ++t) {
    auto buffer = stream_.make_frame(t, paint_mover);
    if (t == 3) GST_BUFFER_FLAG_SET(buffer.get(), GST_BUFFER_FLAG_DISCONT);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream_.harness(), buffer.release()));
    expect_frames(0, t < kWindow - 1 ? 0 : 1);
  }
  expect_rest(1, kWindow);
}

TEST_F(HalfAWindow, AGapInTimeLeavesItAsItIs) {
  stream_.push_many(3 + 25 * 2, kWindow - 4);
  expect_frames(0, 0);
  stream_.push_many(49 + kWindow, 1);
  expect_frames(0, 1);
}

TEST_F(HalfAWindow, AStepBackInTimeLeavesItAsItIs) {
  stream_.push_many(0, kWindow - 4);
  expect_frames(0, 0);
  stream_.push_many(1, 1);
  expect_frames(0, 1);
}

TEST_F(HalfAWindow, AJumpBackInTimeSendsItFirst) {
  stream_.push_many(28, 1);
  expect_frames(0, 0);
  stream_.push_many(3, 1);
  const auto out = stream_.take_all();
  ASSERT_EQ(4u, out.size());
  EXPECT_EQ(28 * kFrame, GST_BUFFER_PTS(out[3].get()));
  stream_.push_many(4, kWindow - 2);
  expect_frames(3, 3);
  stream_.push_many(2 + kWindow, 1);
  expect_frames(3, 4);
  expect_rest(4, 3 + kWindow);
}

TEST_F(HalfAWindow, FramesThatACameraLostLeaveItAsItIs) {
  stream_.push_many(3 + 20, kWindow - 4);
  expect_frames(0, 0);
  stream_.push_many(3 + 20 + kWindow - 4, 1);
  expect_frames(0, 1);
  EXPECT_TRUE(stream_.eos());
  EXPECT_EQ(static_cast<size_t>(kWindow - 1), stream_.take_all().size());
}

TEST_F(HalfAWindow, TimestampsThatAreRoundedLeaveItAsItIs) {
  for (int t = 3; t < kWindow; ++t) {
    auto buffer = stream_.make_frame(t, paint_mover);
    GST_BUFFER_PTS(buffer.get()) += t % 2 ? 9 * GST_MSECOND : 0;
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream_.harness(), buffer.release()));
    if (t < kWindow - 1) expect_frames(0, 0);
  }
  expect_frames(0, 1);
  EXPECT_TRUE(stream_.eos());
  EXPECT_EQ(static_cast<size_t>(kWindow - 1), stream_.take_all().size());
}

TEST_F(HalfAWindow, FramesWithoutTimestampsLeaveItAsItIs) {
  for (int t = 3; t < kWindow; ++t) {
    auto buffer = stream_.make_frame(t, paint_mover);
    GST_BUFFER_PTS(buffer.get()) = GST_CLOCK_TIME_NONE;
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream_.harness(), buffer.release()));
    if (t < kWindow - 1) expect_frames(0, 0);
  }
  expect_frames(0, 1);
  const auto out = stream_.take_to_end();
  ASSERT_EQ(static_cast<size_t>(kWindow - 1), out.size());
  EXPECT_EQ(2 * kFrame, GST_BUFFER_PTS(out[1].get()));
  for (size_t i = 2; i < out.size(); ++i) EXPECT_FALSE(GST_BUFFER_PTS_IS_VALID(out[i].get())) << i;
}

TEST_F(HalfAWindow, FlushDropsIt) {
  send(gst_event_new_flush_start());
  send(gst_event_new_flush_stop(TRUE));
  const GstSegment segment = segment_from(0);
  send(gst_event_new_segment(&segment));
  expect_new_window(3);
}

TEST_F(HalfAWindow, ReversePlaybackBeginsANewOne) {
  const GstSegment segment = segment_from(0, -1);
  send(gst_event_new_segment(&segment));
  expect_frames(0, 3);
  // Time runs back within it, which is no jump.
  for (int t = 40; t > 40 - kWindow; --t) ASSERT_EQ(GST_FLOW_OK, stream_.push(t));
  auto out = stream_.take_all();
  ASSERT_EQ(1u, out.size());
  for (auto& buffer : stream_.take_to_end()) out.push_back(std::move(buffer));
  ASSERT_EQ(static_cast<size_t>(kWindow), out.size());
  for (size_t i = 0; i < out.size(); ++i)
    EXPECT_EQ((40 - i) * kFrame, GST_BUFFER_PTS(out[i].get())) << i;
}

// As GstBaseSrc plays backwards: each buffer says that it does not follow the one before.
TEST_F(HalfAWindow, ReversePlaybackOfASourceThatMarksEachFrame) {
  const GstSegment segment = segment_from(0, -1);
  send(gst_event_new_segment(&segment));
  expect_frames(0, 3);
  const auto push = [this](int t) {
    auto buffer = stream_.make_frame(t, paint_mover);
    GST_BUFFER_FLAG_SET(buffer.get(), GST_BUFFER_FLAG_DISCONT);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream_.harness(), buffer.release()));
  };
  for (int t = 60; t > 60 - kWindow + 1; --t) push(t);
  EXPECT_TRUE(stream_.take_all().empty());
  push(60 - kWindow + 1);
  EXPECT_EQ(1u, stream_.take_all().size());
  // Another part of the stream.
  push(100);
  EXPECT_EQ(static_cast<size_t>(kWindow - 1), stream_.take_all().size());
}

TEST_F(HalfAWindow, AnotherPlaybackRateBeginsANewOne) {
  const GstSegment segment = segment_from(0, 2);
  send(gst_event_new_segment(&segment));
  expect_frames(0, 3);
  expect_new_window(3);
}

// What arrives downstream from now on, in order: the numbers of frames, and names of events.
class Arrivals {
 public:
  explicit Arrivals(GstHarness* harness) : pad_(harness->sinkpad) {
    probe_ = gst_pad_add_probe(
        pad_, GstPadProbeType(GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
        note, this, nullptr);
  }
  ~Arrivals() { gst_pad_remove_probe(pad_, probe_); }
  Arrivals(const Arrivals&) = delete;
  Arrivals& operator=(const Arrivals&) = delete;

  std::string take() { return std::exchange(text_, ""); }

 private:
  static GstPadProbeReturn note(GstPad*, GstPadProbeInfo* info, gpointer data) {
    std::string& text = static_cast<Arrivals*>(data)->text_;
    if (!text.empty()) text += " ";
    if (GST_PAD_PROBE_INFO_TYPE(info) & GST_PAD_PROBE_TYPE_BUFFER) {
      text += std::to_string(GST_BUFFER_PTS(GST_PAD_PROBE_INFO_BUFFER(info)) / kFrame);
      return GST_PAD_PROBE_OK;
    }
    GstEvent* event = GST_PAD_PROBE_INFO_EVENT(info);
    const GstStructure* own = GST_EVENT_TYPE(event) == GST_EVENT_CUSTOM_DOWNSTREAM
                                  ? gst_event_get_structure(event)
                                  : nullptr;
    text += own ? gst_structure_get_name(own) : GST_EVENT_TYPE_NAME(event);
    return GST_PAD_PROBE_OK;
  }

  GstPad* pad_;
  gulong probe_;
  std::string text_;
};

GstEvent* tag(const char* title) {
  return gst_event_new_tag(gst_tag_list_new(GST_TAG_TITLE, title, nullptr));
}
GstEvent* custom(const char* name) {
  return gst_event_new_custom(GST_EVENT_CUSTOM_DOWNSTREAM, gst_structure_new_empty(name));
}

TEST_F(HalfAWindow, TagsAndCustomEventsKeepTheirPlace) {
  Arrivals arrivals(stream_.harness());
  send(tag("street"));
  send(custom("one"));
  stream_.push_many(3, 2);
  send(gst_event_new_gap(5 * kFrame, kFrame));
  stream_.push_many(6, kWindow - 5);
  EXPECT_EQ("0", arrivals.take());
  stream_.push_many(kWindow + 1, 4);
  EXPECT_EQ("1 2 tag one 3 4 gap", arrivals.take());
  send(custom("three"));
  EXPECT_EQ("", arrivals.take());
  EXPECT_TRUE(stream_.eos());
  EXPECT_EQ("6 7 8 9 10 11 12 three eos", arrivals.take());
}

// There is nothing that they could overtake.
TEST_F(HalfAWindow, EventsPassAtOnceWhereNoFrameWaits) {
  send(gst_event_new_gap(3 * kFrame, 10 * GST_SECOND));
  Arrivals arrivals(stream_.harness());
  send(tag("street"));
  send(custom("one"));
  EXPECT_EQ("tag one", arrivals.take());
}

TEST_F(HalfAWindow, EventsOutsideTheStreamPassAtOnce) {
  Arrivals arrivals(stream_.harness());
  send(custom("inside"));
  send(gst_event_new_custom(GST_EVENT_CUSTOM_DOWNSTREAM_OOB, gst_structure_new_empty("outside")));
  EXPECT_EQ("custom-downstream-oob", arrivals.take());
}

TEST_F(HalfAWindow, EventsComeBeforeWhatEndsIt) {
  Arrivals arrivals(stream_.harness());
  send(custom("one"));
  const GstSegment segment = segment_from(10 * GST_SECOND);
  send(gst_event_new_segment(&segment));
  EXPECT_EQ("0 1 2 one segment", arrivals.take());
}

TEST_F(HalfAWindow, EventsComeBeforeOtherCaps) {
  Arrivals arrivals(stream_.harness());
  send(custom("one"));
  stream_.set_caps(GST_VIDEO_FORMAT_RGB, 16, 16);
  stream_.push_many(3, 1);
  EXPECT_TRUE(stream_.eos());
  const std::string text = arrivals.take();
  EXPECT_EQ(0u, text.find("0 1 2 one caps")) << text;
}

// Nothing may come after it for a long time, and others wait for it.
TEST_F(HalfAWindow, TheEndOfAGroupSendsIt) {
  Arrivals arrivals(stream_.harness());
  send(gst_event_new_stream_group_done(7));
  EXPECT_EQ("0 1 2 stream-group-done", arrivals.take());
}

// Downstream still learns what is true of the stream.
TEST_F(HalfAWindow, AFlushDropsEventsButForStickyOnes) {
  Arrivals arrivals(stream_.harness());
  send(tag("street"));
  send(custom("one"));
  send(gst_event_new_flush_start());
  send(gst_event_new_flush_stop(TRUE));
  const GstSegment segment = segment_from(0);
  send(gst_event_new_segment(&segment));
  stream_.push_many(3, kWindow);
  EXPECT_TRUE(stream_.eos());
  GstEvent* kept = gst_pad_get_sticky_event(stream_.harness()->sinkpad, GST_EVENT_TAG, 0);
  ASSERT_NE(nullptr, kept);
  gst_event_unref(kept);
  EXPECT_EQ(std::string::npos, arrivals.take().find("one"));
}

// Upstream goes on, although nobody takes frames any more.
TEST(Events, AreNotHeldWhereDownstreamHasEnded) {
  Stream stream("qdmdbackground window-size=4", GST_VIDEO_FORMAT_RGB, 40, 24);
  stream.push_many(0, 3);
  Arrivals arrivals(stream.harness());
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), tag("street")));
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), custom("one")));
  GstPad* pad = stream.harness()->sinkpad;
  const gulong probe = gst_pad_add_probe(
      pad, GST_PAD_PROBE_TYPE_BUFFER,
      [](GstPad*, GstPadProbeInfo* info, gpointer) {
        if (GST_BUFFER_PTS(GST_PAD_PROBE_INFO_BUFFER(info)) < 2 * kFrame) return GST_PAD_PROBE_OK;
        gst_buffer_unref(GST_PAD_PROBE_INFO_BUFFER(info));
        GST_PAD_PROBE_INFO_DATA(info) = nullptr;
        GST_PAD_PROBE_INFO_FLOW_RETURN(info) = GST_FLOW_EOS;
        return GST_PAD_PROBE_HANDLED;
      },
      nullptr, nullptr);
  stream.push_many(3, 2);
  EXPECT_EQ("0 1", arrivals.take());
  EXPECT_EQ(GST_FLOW_EOS, stream.push(5));
  arrivals.take();
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), custom("two")));
  EXPECT_EQ("tag one", arrivals.take());
  // Frames are dropped now, and what belongs between them.
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_eos()));
  const std::string text = arrivals.take();
  EXPECT_EQ(std::string::npos, text.find("two")) << text;
  EXPECT_NE(std::string::npos, text.find("eos")) << text;
  gst_pad_remove_probe(pad, probe);
}

TEST_F(HalfAWindow, ReconfigureLeavesItAsItIs) {
  gst_harness_push_upstream_event(stream_.harness(), gst_event_new_reconfigure());
  stream_.push_many(3, kWindow - 4);
  expect_frames(0, 0);
  stream_.push_many(kWindow - 1, 1);
  expect_frames(0, 1);
  expect_rest(1, kWindow);
}

// Nothing of upstream's is held, so there is nothing to give back.
TEST_F(HalfAWindow, DrainQueryIsAnswered) {
  GstQuery* query = gst_query_new_drain();
  GstPad* pad = gst_pad_get_peer(stream_.harness()->srcpad);
  EXPECT_TRUE(gst_pad_query(pad, query));
  gst_object_unref(pad);
  gst_query_unref(query);
  stream_.push_many(3, kWindow - 4);
  expect_frames(0, 0);
  stream_.push_many(kWindow - 1, 1);
  expect_frames(0, 1);
  expect_rest(1, kWindow);
}

TEST_F(HalfAWindow, AllocationQueryAsksForNoBuffers) {
  GstCaps* caps = gst_video_info_to_caps(&stream_.info());
  GstQuery* query = gst_query_new_allocation(caps, TRUE);
  GstPad* pad = gst_pad_get_peer(stream_.harness()->srcpad);
  EXPECT_TRUE(gst_pad_query(pad, query));
  for (guint i = 0; i < gst_query_get_n_allocation_pools(query); ++i) {
    guint min = 99;
    gst_query_parse_nth_allocation_pool(query, i, nullptr, nullptr, &min, nullptr);
    EXPECT_LE(min, 1u) << "a window must not need upstream's buffers";
  }
  EXPECT_TRUE(gst_query_find_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr))
      << "padded strides are read";
  EXPECT_FALSE(gst_query_find_allocation_meta(query, GST_VIDEO_CROP_META_API_TYPE, nullptr));
  gst_object_unref(pad);
  gst_query_unref(query);
  gst_caps_unref(caps);
}

// As sources do it that lend their memory: the buffer has a hold on the pool's.
TEST(Pools, WhoseBuffersAreParentsDoNotStall) {
  Stream stream("qdmdbackground window-size=50", GST_VIDEO_FORMAT_RGB, 40, 24);
  const BufferPtr parent = stream.make_frame(0, paint_mover);
  for (int t = 0; t < 20; ++t) {
    GstBuffer* buffer = gst_buffer_copy_region(
        parent.get(), GstBufferCopyFlags(GST_BUFFER_COPY_MEMORY), 0, gsize(-1));
    gst_buffer_add_parent_buffer_meta(buffer, parent.get());
    stream.stamp(buffer, t);
    EXPECT_EQ(2, GST_MINI_OBJECT_REFCOUNT_VALUE(parent.get()));
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer));
    EXPECT_EQ(1, GST_MINI_OBJECT_REFCOUNT_VALUE(parent.get())) << t;
  }
}

TEST(Pools, OfTwoBuffersUpstreamDoNotStall) {
  Stream stream("qdmdbackground window-size=50", GST_VIDEO_FORMAT_RGB, 40, 24);
  GstBufferPool* pool = gst_buffer_pool_new();
  GstStructure* config = gst_buffer_pool_get_config(pool);
  GstCaps* caps = gst_video_info_to_caps(&stream.info());
  gst_buffer_pool_config_set_params(config, caps, static_cast<guint>(stream.info().size), 2, 2);
  gst_caps_unref(caps);
  ASSERT_TRUE(gst_buffer_pool_set_config(pool, config));
  ASSERT_TRUE(gst_buffer_pool_set_active(pool, TRUE));
  size_t out = 0;
  for (int t = 0; t < 250; ++t) {
    GstBuffer* buffer = nullptr;
    GstBufferPoolAcquireParams params = {};
    params.flags = GST_BUFFER_POOL_ACQUIRE_FLAG_DONTWAIT;
    ASSERT_EQ(GST_FLOW_OK, gst_buffer_pool_acquire_buffer(pool, &buffer, &params)) << t;
    stream.stamp(buffer, t);
    stream.fill(buffer, t, paint_mover);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer));
    const size_t now = stream.take_all().size();
    ASSERT_EQ(t < 49 ? 0u : 1u, now) << t;
    out += now;
  }
  EXPECT_EQ(201u, out);
  out += stream.take_to_end().size();
  EXPECT_EQ(250u, out);
  gst_buffer_pool_set_active(pool, FALSE);
  gst_object_unref(pool);
}

// ---- Whole pipelines ----

// Runs to the end; the pipeline is in `use`'s hands before it stops.
void run(const std::string& text, const std::function<void(GstBin*)>& use = nullptr) {
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(text.c_str(), &error);
  ASSERT_EQ(nullptr, error) << error->message;
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* end = gst_bus_timed_pop_filtered(bus, 600 * GST_SECOND,
                                               GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  // A pipeline that is only slow is stopped all the same: the process could not end beside it.
  EXPECT_NE(nullptr, end) << "no end after ten minutes";
  if (end) {
    EXPECT_EQ(GST_MESSAGE_EOS, GST_MESSAGE_TYPE(end));
    gst_message_unref(end);
    if (use) use(GST_BIN(pipeline));
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(pipeline);
}

// The leaks tracer, under which these tests run, counts at the end.
TEST(Pipelines, NinetyFramesLeaveNothingAlive) {
  run("videotestsrc num-buffers=90 ! qdmdbackground window-size=30 ! fakesink");
}

void expect_none_dropped(GstBin* pipeline, const char* name, guint64 frames) {
  GstElement* sink = gst_bin_get_by_name(pipeline, name);
  GstStructure* stats = nullptr;
  guint64 rendered = 0, dropped = 0;
  g_object_get(sink, "stats", &stats, nullptr);
  gst_structure_get(stats, "rendered", G_TYPE_UINT64, &rendered, "dropped", G_TYPE_UINT64, &dropped,
                    nullptr);
  EXPECT_EQ(frames, rendered) << name;
  EXPECT_EQ(0u, dropped) << name;
  gst_structure_free(stats);
  gst_object_unref(sink);
}

// The latency that the pipeline tells its sinks of: the largest of all branches.
GstClockTime latency_of(GstBin* pipeline) {
  GstQuery* query = gst_query_new_latency();
  gboolean live = FALSE;
  GstClockTime least = 0, most = 0;
  EXPECT_TRUE(gst_element_query(GST_ELEMENT(pipeline), query));
  gst_query_parse_latency(query, &live, &least, &most);
  EXPECT_TRUE(live);
  // None drops what comes in time.
  EXPECT_GE(most, least);
  gst_query_unref(query);
  return least;
}

// Half a second of latency in one branch, which the sinks of the others wait for; their queues hold
// what that branch delays. Sinks that are late here, because the machine is, drop nothing.
TEST(Pipelines, ALiveTeeWithAudioBesideKeepsTime) {
  run("videotestsrc is-live=true num-buffers=50 ! "
      "video/x-raw,format=RGB,width=64,height=48,framerate=25/1 ! tee name=t ! queue ! "
      "qdmdbackground window-size=13 ! videoconvert ! "
      "fakesink name=separated sync=true "
      "t. ! queue max-size-time=1000000000 max-size-buffers=0 max-size-bytes=0 ! "
      "fakesink name=original sync=true "
      "audiotestsrc is-live=true num-buffers=86 ! "
      "queue max-size-time=1000000000 max-size-buffers=0 max-size-bytes=0 ! "
      "fakesink name=audio sync=true",
      [](GstBin* pipeline) {
        // A solve takes less than a third of a frame's time, and is done at once. The source has a
        // frame's latency of its own, and sinks a processing-deadline of 20 ms. More where the
        // machine had other things to do than to solve.
        EXPECT_GE(latency_of(pipeline), (13 - 1 + 1) * kFrame + 20 * GST_MSECOND);
        expect_none_dropped(pipeline, "separated", 50);
        expect_none_dropped(pipeline, "original", 50);
        expect_none_dropped(pipeline, "audio", 86);
      });
}

TEST(Pipelines, VeryLargeFramesInAShortWindow) {
  run("videotestsrc num-buffers=3 ! video/x-raw,format=RGB,width=8192,height=4320 ! "
      "qdmdbackground window-size=2 ! fakesink");
}

}  // namespace
}  // namespace qdmd::test
