// SPDX-License-Identifier: LGPL-2.1-or-later
// The background sample, regions, formats, and properties that change while playing.
#include <gst/controller/controller.h>
#include <gst/video/gstvideometa.h>

#include <atomic>
#include <thread>

#include "tests/gst/watched_element.h"

namespace qdmd::test {
namespace {

// ---- The background as a sample ----

TEST(BackgroundSample, IsTheNewestPicture) {
  for (GstVideoFormat format : {GST_VIDEO_FORMAT_RGB, GST_VIDEO_FORMAT_BGRA}) {
    Stream stream("qdmdbackground window-size=16", format, 40, 24);
    Element element(stream);
    EXPECT_EQ(nullptr, element.background());
    stream.push_many(0, 15);
    EXPECT_EQ(nullptr, element.background());
    stream.push_many(15, 17);
    GstSample* sample = element.background();
    ASSERT_NE(nullptr, sample);
    GstVideoInfo info;
    ASSERT_TRUE(gst_video_info_from_caps(&info, gst_sample_get_caps(sample)));
    EXPECT_TRUE(gst_video_info_is_equal(&info, &stream.info()));
    GstBuffer* picture = gst_sample_get_buffer(sample);
    EXPECT_EQ(16 * kFrame, GST_BUFFER_PTS(picture));
    EXPECT_EQ(16 * kFrame, GST_BUFFER_DURATION(picture));
    stream.each_pixel(picture, [](int x, int y, const uint8_t* p, int alpha) {
      uint8_t rgb[3];
      paint_still(0, x, y, rgb);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(rgb[c], p[c], 1) << x << " " << y;
      ASSERT_TRUE(alpha == -1 || alpha == 255);
    });
    gst_sample_unref(sample);
  }
}

TEST(BackgroundSample, IsThereInLiveAndGoneAfterAStop) {
  Stream stream("qdmdbackground mode=live window-size=16", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  stream.push_many(0, 40);
  GstSample* sample = element.background();
  ASSERT_NE(nullptr, sample);
  gst_sample_unref(sample);
  gst_element_set_state(element.get(), GST_STATE_READY);
  gst_element_set_state(element.get(), GST_STATE_PLAYING);
  EXPECT_EQ(nullptr, element.background());
}

// Any thread may read it while frames stream.
TEST(BackgroundSample, IsReadFromOtherThreads) {
  Stream stream("qdmdbackground window-size=4", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  std::atomic<bool> stop = false;
  std::thread reader([&] {
    while (!stop) {
      if (GstSample* sample = element.background()) gst_sample_unref(sample);
      GstStructure* stats = nullptr;
      g_object_get(element.get(), "stats", &stats, nullptr);
      gst_structure_free(stats);
    }
  });
  for (int t = 0; t < 100; ++t) {
    stream.push_many(t, 1);
    stream.take_all();
  }
  stop = true;
  reader.join();
}

// ---- Regions ----

std::vector<GstVideoRegionOfInterestMeta*> regions_of(GstBuffer* buffer, const char* type) {
  std::vector<GstVideoRegionOfInterestMeta*> all;
  gpointer state = nullptr;
  while (auto* meta = gst_buffer_iterate_meta_filtered(
             buffer, &state, GST_VIDEO_REGION_OF_INTEREST_META_API_TYPE)) {
    auto* region = reinterpret_cast<GstVideoRegionOfInterestMeta*>(meta);
    if (region->roi_type == g_quark_from_string(type)) all.push_back(region);
  }
  return all;
}

// Two squares on a still ground, far from each other; a spot of one pixel.
void paint_two(int t, int x, int y, uint8_t rgb[3]) {
  paint_still(t, x, y, rgb);
  const auto white = [&] { rgb[0] = rgb[1] = rgb[2] = 250; };
  const int left = 2 * t % 60;
  if (x >= left && x < left + 12 && y >= 10 && y < 22) white();
  if (x >= 90 - left && x < 96 - left && y >= 60 && y < 66) white();
  if (x == t && y == 45) white();
}

TEST(Regions, AreTheBoxesOfWhatMoves) {
  Stream stream("qdmdbackground window-size=30 regions=true", GST_VIDEO_FORMAT_RGB, 120, 90);
  for (int t = 0; t < 30; ++t) {
    auto buffer = stream.make_frame(t, paint_two);
    gst_buffer_add_video_region_of_interest_meta(buffer.get(), "face", 1, 2, 3, 4);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
  }
  const auto out = stream.take_to_end();
  ASSERT_EQ(30u, out.size());
  for (int t = 0; t < 30; ++t) {
    SCOPED_TRACE(t);
    GstBuffer* buffer = out[static_cast<size_t>(t)].get();
    EXPECT_EQ(1u, regions_of(buffer, "face").size()) << "upstream's stay";
    const auto regions = regions_of(buffer, "foreground");
    ASSERT_EQ(2u, regions.size()) << "one pixel is no region";
    const guint left = static_cast<guint>(2 * t % 60);
    EXPECT_EQ(left, regions[0]->x);
    EXPECT_EQ(10u, regions[0]->y);
    EXPECT_EQ(12u, regions[0]->w);
    EXPECT_EQ(12u, regions[0]->h);
    EXPECT_EQ(90 - left, regions[1]->x);
    EXPECT_EQ(6u, regions[1]->w);
    EXPECT_EQ(1, regions[0]->id) << "the same from frame to frame";
    EXPECT_EQ(2, regions[1]->id);
    const GstStructure* more =
        gst_video_region_of_interest_meta_get_param(regions[0], "foreground");
    ASSERT_NE(nullptr, more);
    guint area = 0;
    double residual = 0;
    ASSERT_TRUE(gst_structure_get(more, "area", G_TYPE_UINT, &area, "mean-residual", G_TYPE_DOUBLE,
                                  &residual, nullptr));
    EXPECT_EQ(144u, area);
    // White is 110 to 200 levels from the ground in each channel.
    EXPECT_GT(residual, 180);
    EXPECT_LE(residual, 255);
  }
}

TEST(Regions, NoneWithoutBeingAskedAndOnlyLargeOnes) {
  Stream stream("qdmdbackground window-size=30", GST_VIDEO_FORMAT_RGB, 120, 90);
  Element element(stream);
  stream.push_many(0, 30, paint_two);
  // The next window's frames come; those of this one leave. A solve is done at once.
  stream.push_many(30, 29, paint_two);
  auto out = stream.take_all();
  ASSERT_EQ(30u, out.size());
  for (const auto& buffer : out) EXPECT_TRUE(regions_of(buffer.get(), "foreground").empty());
  element.set("regions", TRUE, "regions-min-area", 100u);
  stream.push_many(59, 1, paint_two);
  out = stream.take_to_end();
  ASSERT_EQ(30u, out.size());
  for (const auto& buffer : out) EXPECT_EQ(1u, regions_of(buffer.get(), "foreground").size());
}

TEST(Regions, NoneWhereNothingMoves) {
  Stream stream("qdmdbackground window-size=10 regions=true", GST_VIDEO_FORMAT_RGB, 33, 17);
  stream.push_many(0, 10, paint_still);
  const auto out = stream.take_to_end();
  ASSERT_EQ(10u, out.size());
  for (const auto& buffer : out) EXPECT_TRUE(regions_of(buffer.get(), "foreground").empty());
}

// ---- Formats other than packed R, G, B ----

// A grey ground that brightens from left to right, with a square that moves.
int grey_at(int t, int x, int y) {
  const int left = 3 * t % 40;
  return x >= left && x < left + 8 && y >= 8 && y < 16 ? 230 : 60 + x;
}

class PlanarFormats : public testing::TestWithParam<std::tuple<const char*, int, int>> {};

TEST_P(PlanarFormats, BackgroundAndMaskAreThoseOfTheScene) {
  const auto [name, width, height] = GetParam();
  const GstVideoFormat format = gst_video_format_from_string(name);
  for (bool mask : {false, true}) {
    Stream stream(
        std::string("qdmdbackground window-size=40 output=") + (mask ? "mask" : "background"),
        format, width, height);
    const GstVideoInfo& info = stream.info();
    const bool yuv = GST_VIDEO_INFO_IS_YUV(&info);
    const auto each_sample = [&](GstBuffer* buffer, GstMapFlags flags, const auto& see) {
      GstVideoFrame frame;
      ASSERT_TRUE(gst_video_frame_map(&frame, const_cast<GstVideoInfo*>(&info), buffer, flags));
      for (guint c = 0; c < GST_VIDEO_FRAME_N_COMPONENTS(&frame); ++c)
        for (int y = 0; y < GST_VIDEO_FRAME_COMP_HEIGHT(&frame, c); ++y)
          for (int x = 0; x < GST_VIDEO_FRAME_COMP_WIDTH(&frame, c); ++x)
            see(c, x, y,
                static_cast<uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, c)) +
                    y * GST_VIDEO_FRAME_COMP_STRIDE(&frame, c) +
                    x * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c));
      gst_video_frame_unmap(&frame);
    };
    for (int t = 0; t < 40; ++t) {
      BufferPtr buffer(gst_buffer_new_allocate(nullptr, info.size, nullptr));
      stream.stamp(buffer.get(), t);
      each_sample(buffer.get(), GST_MAP_WRITE, [&](guint c, int x, int y, uint8_t* sample) {
        *sample = static_cast<uint8_t>(yuv && c > 0 ? 100 + 20 * c : grey_at(t, x, y));
      });
      ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
    }
    const auto out = stream.take_to_end();
    ASSERT_EQ(40u, out.size());
    for (int t = 0; t < 40; ++t)
      each_sample(out[static_cast<size_t>(t)].get(), GST_MAP_READ,
                  [&](guint c, int x, int y, const uint8_t* sample) {
                    int expected = 60 + x;
                    if (mask)
                      expected = grey_at(t, x, y) == 230 ? (yuv ? 235 : 255) : (yuv ? 16 : 0);
                    if (yuv && c > 0) expected = mask ? 128 : static_cast<int>(100 + 20 * c);
                    ASSERT_NEAR(expected, *sample, 1)
                        << "frame " << t << " component " << c << " at " << x << " " << y;
                  });
  }
}
INSTANTIATE_TEST_SUITE_P(Sizes, PlanarFormats,
                         testing::Combine(testing::Values("GBR", "GRAY8", "I420", "NV12"),
                                          testing::Values(64, 61), testing::Values(32, 31)),
                         [](const auto& suite) {
                           return std::string(std::get<0>(suite.param)) + "_" +
                                  std::to_string(std::get<1>(suite.param)) + "x" +
                                  std::to_string(std::get<2>(suite.param));
                         });

TEST(PlanarFormats, OnePixelOfEach) {
  for (const char* format : {"GBR", "GRAY8", "I420", "NV12"})
    for (const char* output : {"background", "foreground", "mask", "cutout"}) {
      Stream stream(std::string("qdmdbackground window-size=3 regions=true output=") + output,
                    gst_video_format_from_string(format), 1, 1);
      for (int t = 0; t < 4; ++t) {
        BufferPtr buffer(gst_buffer_new_allocate(nullptr, stream.info().size, nullptr));
        gst_buffer_memset(buffer.get(), 0, 77, stream.info().size);
        stream.stamp(buffer.get(), t);
        ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
      }
      ASSERT_TRUE(stream.eos());
      EXPECT_EQ(4u, stream.take_all().size()) << format << " " << output;
    }
}

// Outside of the mask a cut-out is black, which is no zero in Y, U and V.
TEST(PlanarFormats, ACutoutIsBlackOutside) {
  Stream stream("qdmdbackground window-size=4 output=cutout", GST_VIDEO_FORMAT_I420, 16, 16);
  for (int t = 0; t < 4; ++t) {
    BufferPtr buffer(gst_buffer_new_allocate(nullptr, stream.info().size, nullptr));
    gst_buffer_memset(buffer.get(), 0, 90, stream.info().size);
    stream.stamp(buffer.get(), t);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
  }
  const auto out = stream.take_to_end();
  ASSERT_EQ(4u, out.size());
  for (const auto& buffer : out) {
    std::vector<uint8_t> bytes(stream.info().size);
    gst_buffer_extract(buffer.get(), 0, bytes.data(), bytes.size());
    for (size_t i = 0; i < bytes.size(); ++i) ASSERT_EQ(i < 256 ? 16 : 128, bytes[i]) << i;
  }
}

// ---- Shadows ----

// A floor on whose left half a shadow falls from frame 20 on.
void paint_shadow(int t, int x, int y, uint8_t* rgb) {
  const int grain = (x * 37 + y * 91) % 31;
  const double light = t >= 20 && x < 80 ? 0.65 : 1;
  rgb[0] = static_cast<uint8_t>(light * (150 + grain));
  rgb[1] = static_cast<uint8_t>(light * (120 + grain));
  rgb[2] = static_cast<uint8_t>(light * (90 + grain));
}

TEST(Shadows, AreWhatIsAskedFor) {
  Stream stream("qdmdbackground mode=live output=mask", GST_VIDEO_FORMAT_RGB, 160, 120);
  Element element(stream);
  stream.push_many(0, 20, paint_shadow);
  int t = 20;
  // 0: background, 1: foreground, 2: marked. By name and number, and while playing.
  for (int shadows : {0, 1, 2, 0}) {
    element.set("shadows", shadows);
    ASSERT_EQ(GST_FLOW_OK, stream.push(t++, paint_shadow));
    const auto out = stream.take_all();
    GstVideoFrame frame;
    ASSERT_TRUE(gst_video_frame_map(&frame, const_cast<GstVideoInfo*>(&stream.info()),
                                    out.back().get(), GST_MAP_READ));
    size_t counts[256] = {};
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x)
        ++counts[*(static_cast<uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, 1)) +
                   y * GST_VIDEO_FRAME_COMP_STRIDE(&frame, 1) +
                   x * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, 1))];
    gst_video_frame_unmap(&frame);
    constexpr double kHalf = 80 * 120;
    EXPECT_EQ(160u * 120u, counts[0] + counts[127] + counts[255]);
    EXPECT_NEAR(shadows == 1 ? kHalf : 0, double(counts[255]), 0.02 * kHalf) << shadows;
    EXPECT_NEAR(shadows == 2 ? kHalf : 0, double(counts[127]), 0.02 * kHalf) << shadows;
  }
}

// ---- Properties while playing ----

// The pictures are large enough for all threads to have work.
TEST(Threads, ChangeWhilePlayingWithoutChangingPictures) {
  for (const char* mode : {"batch sample-step=1", "live sample-step=1", "batch method=qdmd",
                           "live method=qdmd", "batch method=dmd"}) {
    std::vector<std::vector<uint8_t>> pictures[2];
    for (int changing : {0, 1}) {
      Stream stream(std::string("qdmdbackground window-size=12 n-threads=1 mode=") + mode,
                    GST_VIDEO_FORMAT_RGB, 160, 120);
      Element element(stream);
      for (int t = 0; t < 60; ++t) {
        if (changing && t % 7 == 3) element.set("n-threads", static_cast<guint>(1 + t % 9));
        stream.push_many(t, 1);
        if (t == 59) {
          ASSERT_TRUE(stream.eos());
        }
        for (const auto& buffer : stream.take_all()) {
          pictures[changing].emplace_back(gst_buffer_get_size(buffer.get()));
          gst_buffer_extract(buffer.get(), 0, pictures[changing].back().data(),
                             pictures[changing].back().size());
        }
      }
    }
    EXPECT_EQ(60u, pictures[0].size()) << mode;
    EXPECT_EQ(pictures[0], pictures[1]) << mode;
  }
}

// Everything that may change while playing changes all the time.
TEST(PropertyStorm, LosesNoFrame) {
  constexpr int kFrames = 200;
  for (const char* mode : {"batch", "live hop-size=3", "live hop-size=2 method=qdmd"}) {
    Stream stream(std::string("qdmdbackground window-size=6 mode=") + mode, GST_VIDEO_FORMAT_RGBA,
                  40, 24);
    Element element(stream);
    std::atomic<bool> stop = false;
    std::thread storm([&] {
      for (guint i = 0; !stop; ++i) {
        element.set("output", static_cast<gint>(i % 4), "foreground-threshold", (i % 50) * 1.0,
                    "freeze", i % 11 == 0 ? TRUE : FALSE, "n-threads", i % 4, "post-messages",
                    i % 2 ? TRUE : FALSE, "regions", i % 3 ? TRUE : FALSE, "regions-min-area",
                    i % 20, "time-budget", i % 5 == 0 ? 0.01 * i : 0.0, "absorb-time",
                    0.04 * (i % 7));
        for (GstMessage* message : element.messages()) gst_message_unref(message);
        g_usleep(200);
      }
    });
    size_t out = 0;
    for (int t = 0; t < kFrames; ++t) {
      ASSERT_EQ(GST_FLOW_OK, stream.push(t));
      out += stream.take_all().size();
    }
    stop = true;
    storm.join();
    ASSERT_TRUE(stream.eos());
    out += stream.take_all().size();
    EXPECT_EQ(static_cast<size_t>(kFrames), out) << mode;
    for (GstMessage* message : element.messages()) gst_message_unref(message);
  }
}

// A whole number of `stats`.
guint64 stat_of(const Element& element, const char* name) {
  GstStructure* stats = nullptr;
  g_object_get(element.get(), "stats", &stats, nullptr);
  guint64 wide = 0;
  guint narrow = 0;
  EXPECT_TRUE(gst_structure_get_uint64(stats, name, &wide) ||
              gst_structure_get_uint(stats, name, &narrow))
      << name;
  gst_structure_free(stats);
  return wide + narrow;
}

// No frame is so fast: after the first window, less and less is done.
TEST(TimeBudget, TakesWhatIsSetAsTheMost) {
  Stream stream("qdmdbackground window-size=4 iterations=3 sample-step=2", GST_VIDEO_FORMAT_RGB,
                160, 120);
  Element element(stream);
  element.set("time-budget", 0.000001);
  // A window, and one frame more.
  stream.push_many(0, 5);
  EXPECT_EQ(3u, stat_of(element, "iterations"));
  EXPECT_EQ(2u, stat_of(element, "sample-step"));
  stream.push_many(5, 4 * 40);
  // Iterations are what they are set to: fewer would bring hardly anything back.
  EXPECT_EQ(3u, stat_of(element, "iterations"));
  EXPECT_EQ(4u, stat_of(element, "sample-step"));
  EXPECT_EQ(16u, stat_of(element, "solve-period"));
  // Whatever fits, it is no more than what was set.
  element.set("time-budget", 1e6);
  stream.push_many(165, 4 * 40);
  EXPECT_EQ(3u, stat_of(element, "iterations"));
  EXPECT_EQ(2u, stat_of(element, "sample-step"));
  EXPECT_EQ(1u, stat_of(element, "solve-period"));
  EXPECT_EQ(322u, stream.take_all().size());
  EXPECT_EQ(3u, stream.take_to_end().size());
}

// No frame is so fast: backgrounds are solved as seldom as it goes.
TEST(TimeBudget, MakesSolvesRare) {
  Stream stream("qdmdbackground window-size=4 post-messages=true", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  const auto stat = [&](const char* name) { return stat_of(element, name); };
  stream.push_many(0, 40);
  EXPECT_EQ(10u, stat("solves"));
  EXPECT_EQ(1u, stat("solve-period"));
  element.set("time-budget", 0.000001);
  stream.push_many(40, 4 * 64);
  const guint64 solves = stat("solves") - 10;
  EXPECT_GE(solves, 4u);
  EXPECT_LE(solves, 6u);
  EXPECT_EQ(16u, stat("solve-period"));
  element.set("time-budget", 0.0);
  stream.push_many(296, 40);
  EXPECT_EQ(10 + solves + 10, stat("solves"));
  EXPECT_EQ(333u, stream.take_all().size());
  EXPECT_EQ(3u, stream.take_to_end().size());
  EXPECT_EQ(10 + solves + 10, stat("solves"));
  for (GstMessage* message : element.messages()) {
    const GstStructure* s = gst_message_get_structure(message);
    guint period = 0;
    double time = -1;
    EXPECT_TRUE(gst_structure_get(s, "solve-period", G_TYPE_UINT, &period, "time-per-frame",
                                  G_TYPE_DOUBLE, &time, nullptr));
    EXPECT_TRUE(gst_structure_has_field_typed(s, "sample-step", G_TYPE_UINT));
    EXPECT_TRUE(gst_structure_has_field_typed(s, "iterations", G_TYPE_UINT));
    EXPECT_GE(time, 0);
    gst_message_unref(message);
  }
}

// A ramp from 0 to 100 levels over two seconds.
TEST(Controller, ThresholdFollowsTheFramesTime) {
  Stream stream("qdmdbackground window-size=25 output=mask", GST_VIDEO_FORMAT_RGB, 40, 24);
  Element element(stream);
  GstControlSource* source = gst_interpolation_control_source_new();
  g_object_set(source, "mode", GST_INTERPOLATION_MODE_NONE, nullptr);
  auto* values = GST_TIMED_VALUE_CONTROL_SOURCE(source);
  // Up to 30 levels, then more than any residual has.
  gst_timed_value_control_source_set(values, 0, 30.0 / 442);
  gst_timed_value_control_source_set(values, 10 * kFrame, 1);
  ASSERT_TRUE(gst_object_add_control_binding(
      GST_OBJECT(element.get()),
      gst_direct_control_binding_new(GST_OBJECT(element.get()), "foreground-threshold", source)));
  gst_object_unref(source);
  stream.push_many(0, 25);
  const auto out = stream.take_to_end();
  ASSERT_EQ(25u, out.size());
  for (size_t t = 0; t < 25; ++t) {
    int white = 0;
    stream.each_pixel(out[t].get(), [&](int, int, const uint8_t* p, int) { white += p[0] > 0; });
    if (t < 10)
      EXPECT_GT(white, 10) << t;
    else
      EXPECT_EQ(0, white) << t;
  }
}

}  // namespace
}  // namespace qdmd::test
