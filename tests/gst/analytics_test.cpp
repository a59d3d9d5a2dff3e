// SPDX-License-Identifier: LGPL-2.1-or-later
// The things of a frame as GStreamer's analytics metadata (GStreamer 1.24 and later): they are
// those of the regions, and the mask is the element's.
#include <gst/analytics/analytics.h>

#include <map>

#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 240, kHeight = 180, kSide = 10, kFrames = 30;

// Squares of kSide pixels in rows, far from each other, that all move to the right.
bool in_square(int count, int t, int x, int y) {
  const int row = y / 30, column = (x - 2 * t % 40 + kWidth) % kWidth / 60;
  return 4 * row + column < count && y % 30 < kSide &&
         (x - 2 * t % 40 + kWidth) % kWidth % 60 < kSide;
}

class Analytics : public testing::TestWithParam<int> {
 protected:
  // What leaves qdmdbackground: `count` squares move through the frames.
  std::vector<BufferPtr> separated(const std::string& settings) const {
    Stream stream("qdmdbackground window-size=30 " + settings, GST_VIDEO_FORMAT_RGB, kWidth,
                  kHeight);
    const int count = GetParam();
    stream.push_many(0, kFrames, [&](int t, int x, int y, uint8_t rgb[3]) {
      paint_still(t, x, y, rgb);
      if (in_square(count, t, x, y)) rgb[0] = rgb[1] = rgb[2] = 250;
    });
    return stream.take_to_end();
  }
};

TEST_P(Analytics, AreTheRegions) {
  const auto out = separated("regions=true");
  ASSERT_EQ(size_t(kFrames), out.size());
  std::map<guint64, GstClockTime> seen;
  for (const BufferPtr& buffer : out) {
    std::map<gint, GstVideoRegionOfInterestMeta*> regions;
    gpointer state = nullptr;
    while (auto* meta = gst_buffer_iterate_meta_filtered(
               buffer.get(), &state, GST_VIDEO_REGION_OF_INTEREST_META_API_TYPE)) {
      auto* region = reinterpret_cast<GstVideoRegionOfInterestMeta*>(meta);
      regions[region->id] = region;
    }
    ASSERT_EQ(size_t(GetParam()), regions.size());

    GstAnalyticsRelationMeta* const meta = gst_buffer_get_analytics_relation_meta(buffer.get());
    ASSERT_NE(nullptr, meta);
    size_t detections = 0;
    GstAnalyticsODMtd detection;
    state = nullptr;
    while (gst_analytics_relation_meta_iterate(meta, &state, gst_analytics_od_mtd_get_mtd_type(),
                                               &detection)) {
      ++detections;
      EXPECT_STREQ("foreground", g_quark_to_string(gst_analytics_od_mtd_get_obj_type(&detection)));
      GstAnalyticsTrackingMtd tracking;
      gpointer related = nullptr;
      ASSERT_TRUE(gst_analytics_relation_meta_get_direct_related(
          meta, detection.id, GST_ANALYTICS_REL_TYPE_RELATE_TO,
          gst_analytics_tracking_mtd_get_mtd_type(), &related, &tracking));
      guint64 id = 0;
      GstClockTime first = 0, last = 0;
      gboolean lost = TRUE;
      ASSERT_TRUE(gst_analytics_tracking_mtd_get_info(&tracking, &id, &first, &last, &lost));
      EXPECT_FALSE(lost);
      EXPECT_LE(first, GST_BUFFER_PTS(buffer.get()));
      EXPECT_EQ(first, seen.emplace(id, first).first->second)
          << "it was seen first at one time only";
      ASSERT_EQ(1u, regions.count(gint(id)));
      const GstVideoRegionOfInterestMeta* region = regions[gint(id)];
      gint x = 0, y = 0, width = 0, height = 0;
      gfloat sure = 0;
      ASSERT_TRUE(gst_analytics_od_mtd_get_location(&detection, &x, &y, &width, &height, &sure));
      EXPECT_EQ(gint(region->x), x);
      EXPECT_EQ(gint(region->y), y);
      EXPECT_EQ(gint(region->w), width);
      EXPECT_EQ(gint(region->h), height);
      EXPECT_GT(sure, 0.9f) << "squares fill their boxes";
      EXPECT_LE(sure, 1.0f);
    }
    EXPECT_EQ(regions.size(), detections);
  }
}

#if GST_CHECK_VERSION(1, 26, 0)
TEST_P(Analytics, HaveTheMask) {
  const auto out = separated("regions=true");
  for (int t = 0; t < kFrames; ++t) {
    GstAnalyticsRelationMeta* const meta =
        gst_buffer_get_analytics_relation_meta(out[size_t(t)].get());
    GstAnalyticsSegmentationMtd segmentation;
    gpointer state = nullptr;
    ASSERT_TRUE(gst_analytics_relation_meta_iterate(
        meta, &state, gst_analytics_segmentation_mtd_get_mtd_type(), &segmentation));
    ASSERT_EQ(2u, gst_analytics_segmentation_mtd_get_region_count(&segmentation));
    gsize index = 0;
    ASSERT_TRUE(gst_analytics_segmentation_mtd_get_region_index(&segmentation, &index, 255));
    gint x = -1, y = -1;
    guint width = 0, height = 0;
    const BufferPtr mask(
        gst_analytics_segmentation_mtd_get_mask(&segmentation, &x, &y, &width, &height));
    ASSERT_NE(nullptr, mask);
    EXPECT_EQ(0, x);
    EXPECT_EQ(0, y);
    EXPECT_EQ(guint(kWidth), width);
    EXPECT_EQ(guint(kHeight), height);
    const GstVideoMeta* picture = gst_buffer_get_video_meta(mask.get());
    ASSERT_NE(nullptr, picture);
    EXPECT_EQ(GST_VIDEO_FORMAT_GRAY8, picture->format);
    GstMapInfo map;
    ASSERT_TRUE(gst_buffer_map(mask.get(), &map, GST_MAP_READ));
    for (int row = 0; row < kHeight; ++row)
      for (int column = 0; column < kWidth; ++column)
        ASSERT_EQ(in_square(GetParam(), t, column, row) ? 255 : 0,
                  map.data[row * picture->stride[0] + column])
            << column << " " << row;
    gst_buffer_unmap(mask.get(), &map);
  }
}
#endif

TEST_P(Analytics, AreThereOnlyWhereTheyAreAskedFor) {
  for (const BufferPtr& buffer : separated("regions=false"))
    EXPECT_EQ(nullptr, gst_buffer_get_analytics_relation_meta(buffer.get()));
}

// The metadata begins with room for few, and grows.
INSTANTIATE_TEST_SUITE_P(Squares, Analytics, testing::Values(0, 1, 20));

}  // namespace
}  // namespace qdmd::test
