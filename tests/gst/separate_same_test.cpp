// SPDX-License-Identifier: LGPL-2.1-or-later
// qdmdseparate: each pad gives what a qdmdbackground of its own would.
#include "tests/gst/many_pads.h"

namespace qdmd::test {
namespace {

const std::vector<std::string> kPads = {"background", "foreground", "mask", "cutout"};

// All that happens to a stream.
class Stream {
 public:
  explicit Stream(GstVideoFormat format) : format_(format) {}
  void play(Rig& rig) const {
    rig.start(format_, 32, 18);
    int t = 0;
    const auto frames = [&](int count, guint flags = 0) {
      for (int i = 0; i < count; ++i)
        EXPECT_EQ(GST_FLOW_OK, rig.push(t++, i == 0 ? flags : 0)) << t;
    };
    frames(17);
    frames(3, GST_BUFFER_FLAG_DISCONT);
    rig.send(gst_event_new_gap(static_cast<GstClockTime>(t) * kFrame, kFrame));
    frames(8, GST_BUFFER_FLAG_MARKER);
    rig.set_caps(format_, 32, 18, 50);
    frames(7);
    rig.send(gst_event_new_gap(static_cast<GstClockTime>(t) * kFrame, 10 * GST_SECOND));
    frames(2);
    g_signal_emit_by_name(rig.element(), "reset");
    frames(9);
    rig.set_caps(format_, 31, 17);
    frames(9);
    t = 500;
    rig.flush();
    frames(10);
    rig.segment();
    frames(3);
    rig.send(gst_event_new_stream_start("another"));
    rig.set_caps(format_, 16, 40);
    rig.segment();
    frames(8);
    g_object_set(rig.element(), "foreground-threshold", 60., nullptr);
    frames(8);
    // In the middle of a window.
    EXPECT_TRUE(rig.send(gst_event_new_eos()));
  }

 private:
  GstVideoFormat format_;
};

// One element's pads beside one qdmdbackground for each of them.
void expect_same(GstVideoFormat format, const std::string& settings) {
  const Stream stream(format);
  const std::string options = " " + settings;
  Rig separate("qdmdseparate" + options);
  for (const auto& pad : kPads) separate.listen(pad);
  stream.play(separate);
  for (const auto& pad : kPads) {
    SCOPED_TRACE(pad);
    Rig alone("qdmdbackground output=" + pad + options);
    alone.listen("src");
    stream.play(alone);
    const auto expected = alone.at("src").take();
    const auto own = separate.at(pad).take();
    EXPECT_GT(expected.size(), 60u);
    ASSERT_EQ(expected.size(), own.size());
    for (size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(expected[i].caps, own[i].caps) << i;
      ASSERT_TRUE(expected[i] == own[i]) << i;
    }
    EXPECT_EQ(alone.at("src").take_events(), separate.at(pad).take_events());
  }
}

// Every format that the element takes.
std::vector<GstVideoFormat> formats() {
  GstElement* const element = gst_element_factory_make("qdmdseparate", nullptr);
  GstPad* const pad = gst_element_get_static_pad(element, "sink");
  GstCaps* const caps = gst_pad_get_pad_template_caps(pad);
  std::vector<GstVideoFormat> all;
  const GValue* list = gst_structure_get_value(gst_caps_get_structure(caps, 0), "format");
  for (guint i = 0; i < gst_value_list_get_size(list); ++i)
    all.push_back(
        gst_video_format_from_string(g_value_get_string(gst_value_list_get_value(list, i))));
  gst_caps_unref(caps);
  gst_object_unref(pad);
  gst_object_unref(element);
  return all;
}

class Same : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(Same, AsOneElementForEachOutputInEveryFormat) {
  const auto all = formats();
  EXPECT_GE(all.size(), 23u);
  for (GstVideoFormat format : all) {
    SCOPED_TRACE(gst_video_format_to_string(format));
    expect_same(format, GetParam().second);
    if (HasFatalFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Formats, Same,
    testing::Values(
        std::pair("batch", "method=qdmd rank=1 window-size=6"),
        std::pair("live", "mode=live method=qdmd rank=1 window-size=6 hop-size=2"),
        std::pair("full_rank", "method=qdmd window-size=9"),
        std::pair("dmd", "method=dmd window-size=5"),
        std::pair("robust", "window-size=8 mask-softness=2 shadows=marked regions=true"),
        std::pair("robust_live", "mode=live window-size=8 mask-softness=2 regions=true")),
    [](const auto& one) { return std::string(one.param.first); });

// What of it valgrind has time for.
TEST(SameOfTwo, AsOneElementForEachOutput) {
  expect_same(GST_VIDEO_FORMAT_RGB, "method=qdmd rank=1 window-size=6");
  expect_same(GST_VIDEO_FORMAT_I420, "mode=live window-size=8");
}

// Any subset, in any order of requests.
TEST(Subset, HasThePicturesOfAll) {
  std::vector<std::vector<Arrival>> all;
  for (unsigned subset = 15; subset > 0; --subset) {
    Rig rig("qdmdseparate mask-softness=1 window-size=7");
    for (size_t k = kPads.size(); k-- > 0;)
      if (subset >> k & 1) rig.listen(kPads[k]);
    rig.start(GST_VIDEO_FORMAT_I420, 24, 20);
    for (int t = 0; t < 11; ++t) ASSERT_EQ(GST_FLOW_OK, rig.push(t));
    rig.send(gst_event_new_eos());
    for (size_t k = 0; k < kPads.size(); ++k) {
      if (subset == 15) all.push_back(rig.at(kPads[k]).take());
      if (subset == 15 || !(subset >> k & 1)) continue;
      EXPECT_EQ(all[k], rig.at(kPads[k]).take()) << kPads[k] << " of " << subset;
    }
  }
}

}  // namespace
}  // namespace qdmd::test
