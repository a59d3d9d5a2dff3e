// SPDX-License-Identifier: LGPL-2.1-or-later
// Counts what the element itself allocates: after the first window, nothing for a frame that begins
// no solve. What GStreamer's pools and metadata do is theirs.
#include <algorithm>
#include <set>

#include "tests/core/allocator.h"
#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

// Frames of `format` through `properties`. After the first `skip`, none allocates, but those that
// may.
void for_frames(const std::string& properties, GstVideoFormat format, int skip, int count,
                const std::function<bool(int)>& may_allocate) {
  Stream stream("qdmdbackground " + properties, format, 160, 120);
  std::vector<BufferPtr> frames;
  for (int t = 0; t < 11; ++t) frames.push_back(make_bytes(stream.info(), t));
  ASSERT_TRUE(allocator::see_only("libgstqdmd.so"));
  for (int t = 0; t < skip + count; ++t) {
    GstBuffer* buffer = gst_buffer_copy(frames[static_cast<size_t>(t) % frames.size()].get());
    stream.stamp(buffer, t);
    allocator::start();
    const GstFlowReturn flow = gst_harness_push(stream.harness(), buffer);
    allocator::stop();
    ASSERT_EQ(GST_FLOW_OK, flow);
    stream.take_all();
    const int64_t allocations = allocator::seen().allocations;
    if (t < skip || may_allocate(t)) continue;
    EXPECT_EQ(allocations, 0) << "for frame " << t;
    if (allocations > 0) allocator::print_first();
  }
}

class Allocations : public testing::TestWithParam<GstVideoFormat> {
 protected:
  void SetUp() override {
    if (!allocator::sees_all()) GTEST_SKIP() << "no allocator of our own";
  }
};

TEST_P(Allocations, OfTheDefaultInBatch) {
  // A frame leaves with each that comes.
  for (const char* more : {"", " regions=true", " output=mask"})
    for (const char* threads : {"1", "2"}) {
      SCOPED_TRACE(std::string("n-threads ") + threads + more);
      const std::string properties = std::string("window-size=12 n-threads=") + threads + more;
      // A solve that goes on beside the next frame has memory of its own: nothing else in any other
      // frame, and nothing else in this one's thread.
      for_frames(properties, GetParam(), 24, 36, [](int t) { return t % 12 == 11 || t % 12 == 0; });
      allocator::see_only_this_thread(true);
      for_frames(properties, GetParam(), 24, 36, [](int t) { return t % 12 == 11; });
      allocator::see_only_this_thread(false);
    }
}

TEST_P(Allocations, OfTheDefaultLive) {
  for (const char* more : {"", " output=mask"})
    for (const char* threads : {"1", "2"}) {
      SCOPED_TRACE(std::string("n-threads ") + threads + more);
      // A solve beside the frames has memory of its own: only frames in which none runs are looked
      // at where there is another thread.
      allocator::see_only_this_thread(true);
      int64_t next = 1, last = 0;
      std::set<int64_t> begins;
      // As LiveSchedule has it: the window fills up, then a solve every hop.
      for (; next < 200; last = next, next += std::clamp<int64_t>(last / 2, 1, 4))
        begins.insert(next);
      for_frames(std::string("mode=live window-size=16 hop-size=4 n-threads=") + threads + more,
                 GetParam(), 40, 40, [&](int t) { return begins.count(t + 1) > 0; });
      allocator::see_only_this_thread(false);
    }
}

INSTANTIATE_TEST_SUITE_P(Formats, Allocations,
                         testing::Values(GST_VIDEO_FORMAT_RGB, GST_VIDEO_FORMAT_RGBA,
                                         GST_VIDEO_FORMAT_I420, GST_VIDEO_FORMAT_GRAY8),
                         [](const auto& format) {
                           return gst_video_format_to_string(format.param);
                         });

}  // namespace
}  // namespace qdmd::test
