// SPDX-License-Identifier: LGPL-2.1-or-later
// Things: the numbers of regions, the messages of what becomes of things, and what ends them.
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/gst/many_pads.h"
#include "tests/gst/watched_element.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 120, kHeight = 90;

// One message of an object, or of motion in the whole picture.
struct Told {
  std::string event;
  guint id = 0, x = 0, y = 0, width = 0, height = 0;
  guint64 timestamp = 0, first = 0, running = 0;
  bool cut_off = false, has_snapshot = false, snapshot_is_red = false, fits = false;
};

Told told_of(GstMessage* message) {
  const GstStructure* s = gst_message_get_structure(message);
  Told told;
  told.event = gst_structure_get_string(s, "event");
  gboolean cut_off = FALSE;
  EXPECT_TRUE(gst_structure_get(s, "timestamp", G_TYPE_UINT64, &told.timestamp, "running-time",
                                G_TYPE_UINT64, &told.running, "cut-off", G_TYPE_BOOLEAN, &cut_off,
                                nullptr));
  told.cut_off = cut_off;
  if (!gst_structure_has_field(s, "id")) return told;
  EXPECT_TRUE(gst_structure_get(s, "id", G_TYPE_UINT, &told.id, "x", G_TYPE_UINT, &told.x, "y",
                                G_TYPE_UINT, &told.y, "width", G_TYPE_UINT, &told.width, "height",
                                G_TYPE_UINT, &told.height, "first-running-time", G_TYPE_UINT64,
                                &told.first, nullptr));
  GstSample* sample = nullptr;
  if (gst_structure_get(s, "snapshot", GST_TYPE_SAMPLE, &sample, nullptr)) {
    told.has_snapshot = true;
    GstVideoInfo info;
    EXPECT_TRUE(gst_video_info_from_caps(&info, gst_sample_get_caps(sample)));
    told.fits = GST_VIDEO_INFO_WIDTH(&info) == int(told.width) &&
                GST_VIDEO_INFO_HEIGHT(&info) == int(told.height);
    GstVideoFrame frame;
    EXPECT_TRUE(gst_video_frame_map(&frame, &info, gst_sample_get_buffer(sample), GST_MAP_READ));
    const auto* middle = static_cast<const guint8*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) +
                         GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0) * int(told.height / 2) +
                         3 * (told.width / 2);
    told.snapshot_is_red = middle[0] > 240 && middle[1] < 40;
    gst_video_frame_unmap(&frame);
    gst_sample_unref(sample);
  }
  return told;
}

std::vector<Told> take(const std::vector<GstMessage*>& messages) {
  std::vector<Told> all;
  for (GstMessage* message : messages) {
    if (gst_structure_has_name(gst_message_get_structure(message), "qdmdbackground-object"))
      all.push_back(told_of(message));
    gst_message_unref(message);
  }
  return all;
}

std::vector<Told> of_things(std::vector<Told> all) {
  std::erase_if(all, [](const Told& told) { return told.id == 0; });
  return all;
}

std::string names(const std::vector<Told>& all) {
  std::string text;
  for (const Told& told : all) text += (text.empty() ? "" : " ") + told.event;
  return text;
}

// A red square that comes in from the left with frame 120, stands from frame 150 to 220 and goes
// out on the right.
constexpr int kComes = 120, kStops = 150, kGoesOn = 220, kSide = 16;
int left_of_square(int t) {
  const int walked = std::min(t, kStops) - kComes + std::max(0, t - kGoesOn);
  return 2 * walked - kSide;
}
void paint_visitor(int t, int x, int y, uint8_t rgb[3]) {
  paint_still(t, x, y, rgb);
  const int left = left_of_square(t);
  if (x >= left && x < left + kSide && y >= 40 && y < 40 + kSide)
    rgb[0] = 250, rgb[1] = rgb[2] = 20;
}

constexpr const char* kLive = "qdmdbackground mode=live window-size=40 object-messages=true ";

TEST(Objects, AreToldOfOnceEach) {
  Stream stream(std::string(kLive) + "object-snapshots=true motion-end-time=2.5",
                GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  stream.push_many(0, 360, paint_visitor);
  const auto all = take(element.messages());
  const auto things = of_things(all);
  EXPECT_EQ("appeared stopped moved-on gone", names(things));
  EXPECT_EQ("motion-begins appeared stopped motion-ends motion-begins moved-on gone motion-ends",
            names(all));
  ASSERT_EQ(4u, things.size());
  for (const Told& told : things) {
    EXPECT_EQ(things[0].id, told.id);
    EXPECT_FALSE(told.cut_off);
    EXPECT_NEAR(kComes * double(kFrame), double(told.first), 3 * double(kFrame)) << told.event;
    EXPECT_EQ(told.timestamp, told.running);
    EXPECT_EQ(told.event != "gone", told.has_snapshot) << told.event;
    EXPECT_EQ(told.has_snapshot, told.snapshot_is_red && told.fits) << told.event;
  }
  const auto frame_of = [](const Told& told) { return int(told.timestamp / kFrame); };
  EXPECT_NEAR(kComes + 5, frame_of(things[0]), 10);
  EXPECT_NEAR(kStops + 50, frame_of(things[1]), 10) << "object-stop-time is 2 s";
  EXPECT_EQ(guint(left_of_square(kStops)), things[1].x);
  EXPECT_EQ(guint(kSide), things[1].width);
  EXPECT_NEAR(kGoesOn + 2, frame_of(things[2]), 10);
  EXPECT_NEAR(kGoesOn + 36 + 25, frame_of(things[3]), 10) << "object-gone-time is 1 s";
}

TEST(Objects, SendNothingWithoutBeingAsked) {
  Stream stream("qdmdbackground mode=live window-size=40 regions=true", GST_VIDEO_FORMAT_RGB,
                kWidth, kHeight);
  Element element(stream);
  stream.push_many(0, 180, paint_visitor);
  ASSERT_TRUE(stream.eos());
  EXPECT_TRUE(element.messages().empty());
}

TEST(Objects, HaveTheNumberOfTheirRegions) {
  Stream stream(std::string(kLive) + "regions=true", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  stream.push_many(0, 210, paint_visitor);
  const auto things = of_things(take(element.messages()));
  ASSERT_EQ("appeared stopped", names(things));
  const auto out = stream.take_all();
  int seen = 0;
  for (const auto& buffer : out) {
    auto* meta = reinterpret_cast<GstVideoRegionOfInterestMeta*>(
        gst_buffer_get_meta(buffer.get(), GST_VIDEO_REGION_OF_INTEREST_META_API_TYPE));
    if (!meta) continue;
    ++seen;
    EXPECT_EQ(gint(things[0].id), meta->id);
    const GstStructure* more = gst_video_region_of_interest_meta_get_param(meta, "foreground");
    guint64 age = 0, standing = 0;
    double share = 0, speed = -1;
    ASSERT_TRUE(gst_structure_get(more, "age", G_TYPE_UINT64, &age, "standing", G_TYPE_UINT64,
                                  &standing, "share", G_TYPE_DOUBLE, &share, "speed", G_TYPE_DOUBLE,
                                  &speed, nullptr));
    EXPECT_GT(share, 0.4);
    EXPECT_LE(share, 1);
    EXPECT_GE(speed, 0);
    if (buffer != out.back()) continue;
    EXPECT_NEAR((209 - kComes) * double(kFrame), double(age), 3 * double(kFrame));
    EXPECT_NEAR((209 - kStops) * double(kFrame), double(standing), 5 * double(kFrame));
  }
  EXPECT_NEAR(210 - kComes, seen, 3);
}

// A thing is there, and the stream ends in some way.
class CutOff : public testing::Test {
 protected:
  CutOff() : stream_(kLive, GST_VIDEO_FORMAT_RGB, kWidth, kHeight), element_(stream_) {
    stream_.push_many(0, 160, paint_visitor);
    const auto things = of_things(take(element_.messages()));
    EXPECT_EQ("appeared", names(things));
    if (!things.empty()) id_ = things[0].id;
  }
  // It is gone, and so is motion; once.
  void expect_cut_off() {
    const auto all = take(element_.messages());
    EXPECT_EQ("gone motion-ends", names(all));
    for (const Told& told : all) EXPECT_TRUE(told.cut_off);
    if (!all.empty()) {
      EXPECT_EQ(id_, all[0].id);
    }
  }
  void send(GstEvent* event) { EXPECT_TRUE(gst_harness_push_event(stream_.harness(), event)); }

  Stream stream_;
  Element element_;
  guint id_ = 0;
};

TEST_F(CutOff, AtTheEnd) {
  ASSERT_TRUE(stream_.eos());
  expect_cut_off();
}

TEST_F(CutOff, ByAFlushAndNumbersGoOn) {
  send(gst_event_new_flush_start());
  send(gst_event_new_flush_stop(TRUE));
  expect_cut_off();
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  send(gst_event_new_segment(&segment));
  stream_.push_many(0, 160, paint_visitor);
  const auto things = of_things(take(element_.messages()));
  ASSERT_EQ("appeared", names(things));
  EXPECT_GT(things[0].id, id_);
}

TEST_F(CutOff, ByAnotherSegment) {
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  segment.start = segment.time = segment.position = 100 * GST_SECOND;
  send(gst_event_new_segment(&segment));
  expect_cut_off();
}

TEST_F(CutOff, ByOtherCaps) {
  stream_.set_caps(GST_VIDEO_FORMAT_RGB, kHeight, kWidth);
  expect_cut_off();
}

TEST_F(CutOff, ByAReset) {
  g_signal_emit_by_name(element_.get(), "reset");
  stream_.push_many(160, 1, paint_visitor);
  expect_cut_off();
}

TEST_F(CutOff, WhereNobodyWantsToHearAnyMore) {
  element_.set("object-messages", FALSE);
  stream_.push_many(160, 10, paint_visitor);
  expect_cut_off();
  element_.set("object-messages", TRUE);
  stream_.push_many(170, 30, paint_visitor);
  EXPECT_TRUE(take(element_.messages()).empty()) << "nothing is told of a stream that is too young";
}

TEST(Objects, OfBatchAreToldWithTheirFrames) {
  Stream stream("qdmdbackground window-size=40 object-messages=true", GST_VIDEO_FORMAT_RGB, kWidth,
                kHeight);
  Element element(stream);
  stream.push_many(0, 360, paint_visitor);
  ASSERT_TRUE(stream.eos());
  const auto things = of_things(take(element.messages()));
  ASSERT_FALSE(things.empty());
  EXPECT_EQ("appeared", things.front().event);
  EXPECT_EQ("gone", things.back().event);
  EXPECT_FALSE(things.back().cut_off);
  EXPECT_NEAR(kComes + 5, double(things.front().timestamp) / double(kFrame), 10);
}

// Leaves that flutter are no things, and neither is a flicker.
TEST(Objects, AreNoLeaves) {
  Stream stream(kLive, GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  stream.push_many(0, 400, [](int t, int x, int y, uint8_t rgb[3]) {
    paint_still(t, x, y, rgb);
    const int left = 50 + (t * 7 % 5) - 2;
    if (t % 3 == 0 && x >= left && x < left + 4 && y >= 20 && y < 24) rgb[0] = 250;
  });
  EXPECT_EQ("", names(take(element.messages())));
}

// qdmdseparate: each message once, whatever pads there are, and each pad's buffers alike.
TEST(Objects, OfManyPadsAreToldOnce) {
  for (const std::vector<std::string>& pads :
       {std::vector<std::string>{}, {"mask"}, {"background", "mask", "cutout", "foreground"}}) {
    Rig rig(
        "qdmdseparate mode=live window-size=20 regions=true object-messages=true "
        "object-appear-time=0.1 object-stop-time=0.4 regions-min-area=4");
    for (const std::string& pad : pads) rig.listen(pad);
    rig.start(GST_VIDEO_FORMAT_GRAY8, kWidth, kHeight);
    for (int t = 0; t < 200; ++t) {
      GstBuffer* buffer = gst_buffer_new_allocate(nullptr, size_t{kWidth} * kHeight, nullptr);
      GstMapInfo map;
      ASSERT_TRUE(gst_buffer_map(buffer, &map, GST_MAP_WRITE));
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const int left = t - 120;
          const bool in = x >= left && x < left + 16 && y >= 30 && y < 50 && t >= 120;
          map.data[y * GST_ROUND_UP_4(kWidth) + x] = guint8(in ? 240 : 40 + (3 * x + y) % 40);
        }
      gst_buffer_unmap(buffer, &map);
      GST_BUFFER_PTS(buffer) = GstClockTime(t) * kFrame;
      GST_BUFFER_DURATION(buffer) = kFrame;
      gst_pad_push(rig.feed(), buffer);
    }
    rig.send(gst_event_new_eos());
    std::vector<GstMessage*> messages;
    while (GstMessage* message = gst_bus_pop_filtered(rig.bus(), GST_MESSAGE_ELEMENT))
      messages.push_back(message);
    EXPECT_EQ("appeared gone", names(of_things(take(messages)))) << pads.size();
    std::vector<guint> first;
    for (const std::string& pad : pads) {
      std::vector<guint> regions;
      for (const Arrival& arrival : rig.at(pad).take()) regions.push_back(arrival.regions);
      EXPECT_GT(*std::max_element(regions.begin(), regions.end()), 0u);
      if (first.empty()) first = regions;
      EXPECT_EQ(first, regions) << pad;
    }
  }
}

}  // namespace
}  // namespace qdmd::test
