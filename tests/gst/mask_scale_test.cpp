// SPDX-License-Identifier: LGPL-2.1-or-later
// mask-scale: masks that are found in a smaller picture, and when the element chooses that.
#include <glib/gstdio.h>

#include <cstdlib>

#include "tests/gst/many_pads.h"
#include "tests/gst/video_frames.h"
#include "tests/gst/watched_element.h"

namespace qdmd::test {
namespace {

// Masks of every layout, beside those of all pixels. White is above half of what a sample can be.
TEST(MaskScale, FindsTheSameInEveryFormat) {
  for (const char* name : {"RGBA", "BGRx", "RGB", "GRAY8", "I420", "NV12", "YUY2", "Y42B", "Y444",
                           "AYUV", "I420_10LE", "P010_10LE", "GRAY16_LE", "RGBA64_LE"})
    for (const std::string scale : {"mask-scale=2", "mode=live mask-scale=2", "mask-scale=4"}) {
      SCOPED_TRACE(std::string(name) + " " + scale);
      GstVideoInfo info;
      ASSERT_TRUE(gst_video_info_set_format(&info, gst_video_format_from_string(name), 301, 203));
      info.fps_n = 25, info.fps_d = 1;
      std::vector<Frame> frames;
      for (int t = 0; t < 30; ++t) {
        // A square that is large enough for a quarter of the pixels.
        Frame frame = make_frame(info, 1000);
        for (guint c = 0; c < frame.size() && c < 3; ++c) {
          const int columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, c),
                    rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, c);
          const int low = GST_VIDEO_INFO_COMP_DEPTH(&info, c) - 8;
          for (int y = 0; y < frame[c].height; ++y)
            for (int x = 0; x < frame[c].width; ++x)
              if (x * columns >= 9 * t && x * columns < 9 * t + 40 && y * rows >= 40 &&
                  y * rows < 120)
                frame[c].samples[static_cast<size_t>(y * frame[c].width + x)] =
                    static_cast<uint16_t>((240 - 60 * static_cast<int>(c)) << low);
        }
        frames.push_back(std::move(frame));
      }
      const std::string settings = "output=mask window-size=15 ";
      const bool live = scale.starts_with("mode=live");
      const auto whole = run(settings + (live ? "mode=live " : "") + "mask-scale=1", info, frames),
                 reduced = run(settings + scale, info, frames);
      ASSERT_EQ(whole.size(), reduced.size());
      const int half = 1 << (GST_VIDEO_INFO_COMP_DEPTH(&info, 0) - 1);
      double both = 0, one = 0;
      for (size_t t = 10; t < whole.size(); ++t)
        for (size_t p = 0; p < whole[t][0].samples.size(); ++p) {
          const bool a = whole[t][0].samples[p] >= half, b = reduced[t][0].samples[p] >= half;
          both += a && b;
          one += a != b;
        }
      EXPECT_GT(both, 20000);
      EXPECT_GT(2 * both / (2 * both + one), 0.9);
    }
}

constexpr int kWidth = 2000, kHeight = 1251;  // more than 2.5 million

// Whether what is learnt has fewer pixels: the background's are equal in blocks of four then.
bool is_reduced(Stream& stream, Element& element) {
  const auto bytes = element.background_bytes();
  const auto width = static_cast<size_t>(stream.info().width);
  EXPECT_EQ(bytes.size(), stream.info().size);
  size_t equal = 0, pairs = 0;
  for (size_t p = 0; p + 1 < width && !bytes.empty(); p += 2, ++pairs)
    equal += bytes[p] == bytes[p + 1] && bytes[p] == bytes[width + p];
  EXPECT_TRUE(equal == pairs || equal < pairs / 2);
  return equal == pairs;
}

void paint_grey(int, int x, int y, uint8_t rgb[3]) {
  rgb[0] = rgb[1] = rgb[2] = static_cast<uint8_t>(60 + (37 * x + 11 * y) % 97);
}

// Of a stream with these settings, which stays for `then`.
template <typename Then>
void play(const std::string& settings, int width, int height, Then then) {
  Stream stream("qdmdbackground mode=live window-size=2 " + settings, GST_VIDEO_FORMAT_GRAY8, width,
                height);
  Element element(stream);
  stream.push_many(0, 3, paint_grey);
  then(stream, element);
}

bool reduces(const std::string& settings, int width = kWidth, int height = kHeight) {
  bool is = false;
  play(settings, width, height,
       [&](Stream& stream, Element& element) { is = is_reduced(stream, element); });
  return is;
}

TEST(MaskScale, IsChosenForLargeMasksAlone) {
  EXPECT_TRUE(reduces("output=mask"));
  EXPECT_FALSE(reduces("output=mask", kWidth, kHeight - 1));
  EXPECT_FALSE(reduces("output=background"));
  EXPECT_FALSE(reduces("output=cutout"));
  EXPECT_FALSE(reduces("output=mask mask-scale=1"));
  EXPECT_TRUE(reduces("output=mask mask-scale=2", 200, 100));
  EXPECT_TRUE(reduces("output=background mask-scale=2", 200, 100));
  // Snapshots are pictures.
  EXPECT_TRUE(reduces("output=mask object-messages=true"));
  EXPECT_FALSE(reduces("output=mask object-messages=true object-snapshots=true"));
}

TEST(MaskScale, OtherPicturesComeWithAWarning) {
  play("output=mask", kWidth, kHeight, [&](Stream& stream, Element& element) {
    EXPECT_EQ(element.warning(), "");
    element.set("output", 0);
    stream.push_many(3, 2, paint_grey);
    const std::string text = element.warning();
    EXPECT_NE(text.find("mask-scale=1"), std::string::npos) << text;
    stream.push_many(5, 1, paint_grey);
    EXPECT_EQ(element.warning(), "");
    EXPECT_TRUE(is_reduced(stream, element));
    // From the next video on it is known.
    stream.set_caps(GST_VIDEO_FORMAT_GRAY8, kWidth + 2, kHeight);
    stream.push_many(6, 2, paint_grey);
    EXPECT_FALSE(is_reduced(stream, element));
  });
}

TEST(MaskScale, ThreeIsRefused) {
  Stream stream("qdmdbackground", GST_VIDEO_FORMAT_GRAY8, 64, 48);
  Element element(stream);
  element.set("mask-scale", 3u);
  element.warning();
  stream.set_caps(GST_VIDEO_FORMAT_GRAY8, 66, 48);
  GstBus* const bus = gst_element_get_bus(element.get());
  stream.push(0, paint_grey);
  const std::string text = next_text(bus, GST_MESSAGE_ERROR);
  gst_object_unref(bus);
  EXPECT_NE(text.find("mask-scale"), std::string::npos) << text;
}

TEST(MaskScale, WhatWasSavedOfAllPixelsGoesOn) {
  gchar* const folder = g_dir_make_tmp("qdmd-XXXXXX", nullptr);
  const std::string whole = std::string(folder) + "/whole", half = std::string(folder) + "/half";
  play("output=background", kWidth, kHeight,
       [&](Stream&, Element& element) { EXPECT_TRUE(element.save(whole)); });
  EXPECT_FALSE(reduces("output=mask load-location=" + whole));
  play("output=mask", kWidth, kHeight, [&](Stream& stream, Element& element) {
    EXPECT_TRUE(element.save(half));
    EXPECT_TRUE(element.load(half));
    EXPECT_FALSE(element.load(whole));
    const std::string text = element.warning();
    for (const char* word : {"2000x1251", "1000x626", "mask-scale"})
      EXPECT_NE(text.find(word), std::string::npos) << text;
    stream.push_many(3, 1, paint_grey);
    EXPECT_TRUE(is_reduced(stream, element));
  });
  EXPECT_TRUE(reduces("output=mask load-location=" + half));
  g_unlink(whole.c_str());
  g_unlink(half.c_str());
  g_rmdir(folder);
  g_free(folder);
}

bool separate_reduces(std::initializer_list<const char*> pads) {
  Rig rig("qdmdseparate mode=live window-size=2");
  for (const char* pad : pads) rig.listen(pad);
  rig.start(GST_VIDEO_FORMAT_GRAY8, kWidth, kHeight);
  for (int t = 0; t < 3; ++t) EXPECT_EQ(GST_FLOW_OK, rig.push(t));
  GstSample* sample = nullptr;
  g_object_get(rig.element(), "background", &sample, nullptr);
  GstMapInfo map;
  EXPECT_TRUE(gst_buffer_map(gst_sample_get_buffer(sample), &map, GST_MAP_READ));
  size_t equal = 0;
  for (size_t p = 0; p < size_t{kWidth}; p += 2) equal += map.data[p] == map.data[p + 1];
  gst_buffer_unmap(gst_sample_get_buffer(sample), &map);
  gst_sample_unref(sample);
  return equal == kWidth / 2;
}

TEST(MaskScale, SeparatedMasksAloneAreReduced) {
  EXPECT_TRUE(separate_reduces({"mask"}));
  EXPECT_FALSE(separate_reduces({"mask", "background"}));
  EXPECT_FALSE(separate_reduces({"background"}));
}

}  // namespace
}  // namespace qdmd::test
