// SPDX-License-Identifier: LGPL-2.1-or-later
// What masks leave out and how they fade, as users ask for it.
#include <gst/video/gstvideometa.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "tests/gst/watched_element.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 120, kHeight = 90;

// A square in the middle that comes after frame 5 of a still picture.
void paint_square(int t, int x, int y, uint8_t rgb[3]) {
  paint_still(t, x, y, rgb);
  if (t >= 5 && x >= 40 && x < 80 && y >= 30 && y < 60) rgb[0] = rgb[1] = 250, rgb[2] = 20;
}

struct Rect {
  int x, y, width, height;
  bool has(int col, int row) const {
    return col >= x && col < x + width && row >= y && row < y + height;
  }
};
constexpr Rect kSquare = {40, 30, 40, 30};

// Pixels that are white in an output buffer, inside of a rectangle and elsewhere.
struct White {
  int inside = 0, outside = 0, between = 0;
};
White white_of(const Stream& stream, GstBuffer* buffer, const Rect& area) {
  White white;
  stream.each_pixel(buffer, [&](int x, int y, const uint8_t* p, int) {
    if (p[1] == 255) ++(area.has(x, y) ? white.inside : white.outside);
    white.between += p[1] > 0 && p[1] < 255;
  });
  return white;
}

std::string ignored(GstElement* element) {
  GValue value = G_VALUE_INIT;
  g_value_init(&value, GST_TYPE_ARRAY);
  g_object_get_property(G_OBJECT(element), "ignore", &value);
  gchar* text = gst_value_serialize(&value);
  g_value_unset(&value);
  std::string all = text;
  g_free(text);
  // Without types and spaces.
  std::string plain;
  bool type = false;
  for (char c : all) {
    type |= c == '(';
    if (!type && c != ' ') plain += c;
    type &= c != ')';
  }
  return plain;
}

void set_from_text(GstElement* element, const char* text) {
  gst_util_set_object_arg(G_OBJECT(element), "ignore", text);
}

TEST(Ignore, IsWrittenAsPipelinesWriteIt) {
  Stream stream(
      "qdmdbackground output=mask window-size=10 ignore=\"<<0,0,60,90>,<70,-10,5,100000>>\"",
      GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  EXPECT_EQ("<<0,0,60,90>,<70,-10,5,100000>>", ignored(element.get()));
  stream.push_many(0, 30, paint_square);
  const auto out = stream.take_to_end();
  ASSERT_EQ(30u, out.size());
  const White white = white_of(stream, out[5].get(), {60, 30, 10, 30});
  EXPECT_EQ(10 * 30, white.inside);
  EXPECT_EQ(5 * 30, white.outside);
}

guint regions_in(GstBuffer* buffer) {
  return gst_buffer_get_n_meta(buffer, GST_VIDEO_REGION_OF_INTEREST_META_API_TYPE);
}

// As applications do in C.
void append(GValue* array, std::initializer_list<int> numbers) {
  GValue rectangle = G_VALUE_INIT;
  g_value_init(&rectangle, GST_TYPE_ARRAY);
  for (int number : numbers) {
    GValue element = G_VALUE_INIT;
    g_value_init(&element, G_TYPE_INT);
    g_value_set_int(&element, number);
    gst_value_array_append_and_take_value(&rectangle, &element);
  }
  gst_value_array_append_and_take_value(array, &rectangle);
}

// An element that is made from a text has its properties before it is in a pipeline that hears it.
TEST(Ignore, SaysWhatItLeavesOutOnceItStarts) {
  Stream stream("qdmdbackground ignore=<<1,2,3>>", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  gst_element_set_state(element.get(), GST_STATE_READY);
  EXPECT_EQ("", element.warning());
  gst_element_set_state(element.get(), GST_STATE_PLAYING);
  EXPECT_NE(std::string::npos, element.warning().find("leaves out 1 rectangle"));
}

TEST(Ignore, SaysWhatIsOutsideOfThePicture) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  const auto warning_of = [&](const std::string& rectangles) {
    set_from_text(element.get(), rectangles.c_str());
    EXPECT_EQ("", element.warning());  // Frames may be of any size.
    stream.push_many(0, 2);
    return element.warning();
  };
  const std::string size = std::to_string(kWidth) + "x" + std::to_string(kHeight);
  EXPECT_EQ("", warning_of("<<0,0,1,1>,<-5,-5,6,6>>"));
  const std::string right = "<" + std::to_string(kWidth) + ",0,9,9>";
  const std::string text =
      warning_of("<" + right + ",<0,0,1,1>,<-5,3,5,9>,<0," + std::to_string(kHeight) + ",1,1>>");
  EXPECT_NE(std::string::npos, text.find("3 rectangles outside")) << text;
  EXPECT_NE(std::string::npos, text.find(size)) << text;
  // It says so once.
  stream.push_many(2, 4);
  EXPECT_EQ("", element.warning());
  // In a smaller picture more is outside.
  set_from_text(element.get(), "<<40,0,5,5>>");
  stream.push_many(6, 1);
  EXPECT_EQ("", element.warning());
  stream.set_caps(GST_VIDEO_FORMAT_RGB, 32, 24);
  stream.push_many(7, 1);
  EXPECT_NE(std::string::npos, element.warning().find("1 rectangle outside"));
}

TEST(Ignore, SaysThatNothingIsLeft) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  const std::string all = std::to_string(kWidth) + "," + std::to_string(kHeight);
  set_from_text(element.get(), ("<<-1,0," + all + ">>").c_str());
  stream.push_many(0, 2);
  EXPECT_EQ("", element.warning());
  set_from_text(element.get(), ("<<0,0," + all + ">>").c_str());
  stream.push_many(2, 2);
  EXPECT_NE(std::string::npos, element.warning().find("covers the whole picture"));
  EXPECT_EQ("", element.warning());
}

TEST(Ignore, LeavesOutWhatIsNoRectangleAndSaysSo) {
  Stream stream("qdmdbackground", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  EXPECT_EQ("<>", ignored(element.get()));
  const auto set = [&](std::initializer_list<std::initializer_list<int>> rectangles) {
    GValue value = G_VALUE_INIT;
    g_value_init(&value, GST_TYPE_ARRAY);
    for (const auto& rectangle : rectangles) append(&value, rectangle);
    g_object_set_property(G_OBJECT(element.get()), "ignore", &value);
    g_value_unset(&value);
  };
  set({{1, 2, 3, 4}, {-5, -6, 7, 8}});
  EXPECT_EQ("<<1,2,3,4>,<-5,-6,7,8>>", ignored(element.get()));
  EXPECT_EQ("", element.warning());
  set({{1, 2, 0, 4}, {1, 2, 3, -4}, {1, 2, 3}, {1, 2, 3, 4, 5}, {9, 9, 9, 9}, {}});
  EXPECT_EQ("<<9,9,9,9>>", ignored(element.get()));
  EXPECT_NE(std::string::npos, element.warning().find("leaves out 5 rectangles"));
  std::string many = "<<1,1,1,1>";
  for (int i = 0; i < 64; ++i) many += ",<2,2,2,2>";
  set_from_text(element.get(), (many + ">").c_str());
  EXPECT_NE(std::string::npos, element.warning().find("leaves out 1 rectangle"));
  set({});
  EXPECT_EQ("<>", ignored(element.get()));
  EXPECT_EQ("", element.warning());
}

// In masks, cut-outs and regions, from the next frame that leaves on.
TEST(Ignore, ChangesWhilePlaying) {
  const auto paint = [](int t, int x, int y, uint8_t rgb[3]) {
    paint_still(t, x, y, rgb);
    if (x / 20 == t % 6 && y >= 30 && y < 60) rgb[0] = rgb[1] = 250, rgb[2] = 20;
  };
  for (const char* mode : {"batch", "live"})
    for (const char* output : {"mask", "cutout"}) {
      SCOPED_TRACE(std::string(mode) + " " + output);
      Stream stream(std::string("qdmdbackground window-size=12 regions=true mode=") + mode +
                        " output=" + output,
                    GST_VIDEO_FORMAT_RGBA, kWidth, kHeight);
      Element element(stream);
      size_t left = 0;
      for (int t = 0; t < 60; ++t) {
        const char* const areas[] = {"<<0,0,1000,1000>>", "<>", "<<0,0,120,45>>"};
        set_from_text(element.get(), areas[t % 3]);
        ASSERT_EQ(GST_FLOW_OK, stream.push(t, paint));
        for (const auto& buffer : stream.take_all()) {
          ++left;
          if (t < 40) continue;
          int seen = 0;
          stream.each_pixel(buffer.get(),
                            [&](int, int, const uint8_t* p, int) { seen += p[1] > 0; });
          const int expected = t % 3 == 0 ? 0 : t % 3 == 1 ? 20 * 30 : 20 * 15;
          ASSERT_NEAR(expected, seen, expected / 10) << t;
          ASSERT_EQ(expected > 0 ? 1u : 0u, regions_in(buffer.get()));
        }
      }
      EXPECT_EQ(60u, left + stream.take_to_end().size());
    }
}

// Each frame has its own, whenever it leaves; they stay on it.
TEST(Ignore, TakesRegionsOfATypeFromBuffers) {
  Stream stream("qdmdbackground window-size=20 output=mask ignore-roi-type=face",
                GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  for (int t = 0; t < 20; ++t) {
    auto buffer = stream.make_frame(t, paint_square);
    const char* type = t % 3 == 0 ? "face" : "car";
    gst_buffer_add_video_region_of_interest_meta(buffer.get(), type, 60, 0, G_MAXUINT, G_MAXUINT);
    ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
  }
  const auto out = stream.take_to_end();
  ASSERT_EQ(20u, out.size());
  // Some frames of the window show the square already: those in which it is foreground.
  for (int t = 5; t < 8; ++t) {
    const White white = white_of(stream, out[size_t(t)].get(), {60, 30, 20, 30});
    EXPECT_EQ(1u, regions_in(out[size_t(t)].get()));
    EXPECT_EQ(t % 3 == 0 ? 0 : 20 * 30, white.inside) << t;
    EXPECT_EQ(20 * 30, white.outside) << t;
  }
  gchar* type = nullptr;
  g_object_get(element.get(), "ignore-roi-type", &type, nullptr);
  EXPECT_STREQ("face", type);
  g_free(type);
  for (const char* none : {"", static_cast<const char*>(nullptr)}) {
    element.set("ignore-roi-type", none);
    g_object_get(element.get(), "ignore-roi-type", &type, nullptr);
    EXPECT_EQ(nullptr, type);
  }
}

TEST(Ignore, MayBeTheOnlyPixel) {
  for (const char* format : {"RGBA", "I420", "GRAY8"})
    for (const char* output : {"mask", "cutout", "background", "foreground"}) {
      Stream stream(std::string("qdmdbackground window-size=3 regions=true mask-softness=3 "
                                "ignore=<<0,0,1,1>> output=") +
                        output,
                    gst_video_format_from_string(format), 1, 1);
      for (int t = 0; t < 5; ++t) {
        BufferPtr buffer(gst_buffer_new_allocate(nullptr, stream.info().size, nullptr));
        gst_buffer_memset(buffer.get(), 0, t == 3 ? 250 : 77, stream.info().size);
        stream.stamp(buffer.get(), t);
        ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
      }
      const auto out = stream.take_to_end();
      ASSERT_EQ(5u, out.size());
      if (std::string(output) != "mask") continue;
      for (const auto& buffer : out) {
        uint8_t first = 255;
        gst_buffer_extract(buffer.get(), 0, &first, 1);
        EXPECT_EQ(std::string(format) == "I420" ? 16 : 0, first);
      }
    }
}

// ---- Softness ----

TEST(Softness, FadesMasksAndCutoutsInEveryFormat) {
  for (const char* name : {"RGB", "RGBA", "BGRx", "GRAY8", "GBR", "I420", "NV12"})
    for (const char* output : {"mask", "cutout"}) {
      SCOPED_TRACE(std::string(name) + " " + output);
      Stream stream(std::string("qdmdbackground window-size=20 mask-softness=4 output=") + output,
                    gst_video_format_from_string(name), kWidth, kHeight);
      const GstVideoInfo& info = stream.info();
      const bool yuv = GST_VIDEO_INFO_IS_YUV(&info), mask = std::string(output) == "mask";
      for (int t = 0; t < 20; ++t) {
        BufferPtr buffer(gst_buffer_new_allocate(nullptr, info.size, nullptr));
        stream.stamp(buffer.get(), t);
        GstVideoFrame frame;
        ASSERT_TRUE(gst_video_frame_map(&frame, const_cast<GstVideoInfo*>(&info), buffer.get(),
                                        GST_MAP_WRITE));
        for (guint c = 0; c < GST_VIDEO_FRAME_N_COMPONENTS(&frame); ++c)
          for (int y = 0; y < GST_VIDEO_FRAME_COMP_HEIGHT(&frame, c); ++y)
            for (int x = 0; x < GST_VIDEO_FRAME_COMP_WIDTH(&frame, c); ++x) {
              // A square whose edge fades over eight pixels.
              const int far =
                  t < 17 ? 0 : std::clamp(30 - std::max(abs(x - 60), abs(y - 45)), 0, 8);
              const int level = yuv && c > 0 ? 128 : c == 3 ? 200 : 60 + 20 * far;
              *(static_cast<uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, c)) +
                y * GST_VIDEO_FRAME_COMP_STRIDE(&frame, c) +
                x * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c)) = static_cast<uint8_t>(level);
            }
        gst_video_frame_unmap(&frame);
        ASSERT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
      }
      const auto out = stream.take_to_end();
      ASSERT_EQ(20u, out.size());
      GstVideoFrame frame;
      ASSERT_TRUE(gst_video_frame_map(&frame, const_cast<GstVideoInfo*>(&info), out[19].get(),
                                      GST_MAP_READ));
      // From the middle to the right border of the picture, it only goes down.
      const bool in_alpha = GST_VIDEO_INFO_HAS_ALPHA(&info) && !mask;
      const int component = in_alpha ? 3 : 0;
      const auto* row = static_cast<uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, component)) +
                        45 * GST_VIDEO_FRAME_COMP_STRIDE(&frame, component);
      const auto at = [&](int x) {
        return int{row[x * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, component)]};
      };
      const int black = yuv ? 16 : 0, white = mask ? (yuv ? 235 : 255) : in_alpha ? 200 : 220;
      EXPECT_EQ(white, at(60));
      EXPECT_EQ(black, at(119));
      int levels = 0;
      for (int x = 61; x < 120; ++x) {
        EXPECT_LE(at(x), at(x - 1)) << x;
        levels += at(x) < white && at(x) > black;
      }
      EXPECT_GE(levels, 4);
      EXPECT_LE(levels, 20);
      gst_video_frame_unmap(&frame);
    }
}

TEST(Softness, IsHardWithoutBeingAskedAndChangesWhilePlaying) {
  Stream stream("qdmdbackground window-size=10 output=mask", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  const auto paint = [](int t, int x, int y, uint8_t rgb[3]) {
    paint_still(t, x, y, rgb);
    const int far = std::clamp(20 - std::max(abs(x - 10 - 2 * t), abs(y - 45)), 0, 8);
    for (int c = 0; c < 3; ++c) rgb[c] = static_cast<uint8_t>(rgb[c] + (250 - rgb[c]) * far / 8);
  };
  int soft = 0;
  for (int t = 0; t < 40; ++t) {
    element.set("mask-softness", t % 4 < 2 ? 0u : 3u);
    ASSERT_EQ(GST_FLOW_OK, stream.push(t, paint));
    for (const auto& buffer : stream.take_all()) {
      const White white = white_of(stream, buffer.get(), kSquare);
      if (t % 4 < 2) {
        EXPECT_EQ(0, white.between) << t;
      } else {
        soft += white.between > 50;
      }
    }
  }
  EXPECT_GE(soft, 12);
}

// All of it changes all the time, from another thread.
TEST(Softness, AndIgnoredAreasInAStorm) {
  for (const char* mode : {"batch", "live hop-size=3"}) {
    Stream stream(std::string("qdmdbackground window-size=6 output=cutout mode=") + mode,
                  GST_VIDEO_FORMAT_RGBA, 80, 70);
    Element element(stream);
    std::atomic<bool> stop = false;
    std::thread storm([&] {
      const char* const types[] = {"face", "car", "", nullptr};
      const char* const areas[] = {"<>", "<<3,3,20,20>>", "<<0,0,1000,1000>,<-5,-5,6,6>>"};
      for (guint i = 0; !stop; ++i) {
        element.set("mask-softness", i % 16, "ignore-roi-type", types[i % 4], "n-threads", i % 4,
                    "shadows", static_cast<gint>(i % 3), "output", static_cast<gint>(i % 4));
        set_from_text(element.get(), areas[i % 3]);
        ignored(element.get());
        g_usleep(100);
      }
    });
    size_t out = 0;
    for (int t = 0; t < 150; ++t) {
      auto buffer = stream.make_frame(t, paint_mover);
      gst_buffer_add_video_region_of_interest_meta(buffer.get(), "car", 1, 2, 30, 4);
      EXPECT_EQ(GST_FLOW_OK, gst_harness_push(stream.harness(), buffer.release()));
      out += stream.take_all().size();
    }
    stop = true;
    storm.join();
    EXPECT_EQ(150u, out + stream.take_to_end().size()) << mode;
  }
}

}  // namespace
}  // namespace qdmd::test
