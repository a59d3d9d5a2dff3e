// Y, U and V in every layout against a plain reference: each sample given to the pixels that share
// it, the element on these, and the mean of what comes out.
#include <array>

#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

constexpr int kFrames = 10;

// A component's samples at the size that the format gives it.
struct Component {
  int width = 0, height = 0;
  std::vector<uint8_t> samples;

  uint8_t at(int x, int y) const { return samples[static_cast<size_t>(y * width + x)]; }
};
using Frame = std::vector<Component>;

GstVideoInfo info_of(GstVideoFormat format, int width, int height,
                     GstVideoColorRange range = GST_VIDEO_COLOR_RANGE_16_235) {
  GstVideoInfo info;
  gst_video_info_set_format(&info, format, static_cast<guint>(width), static_cast<guint>(height));
  info.fps_n = 25, info.fps_d = 1;
  info.colorimetry.range = range;
  return info;
}

// Calls see(component, x, y, sample) for every sample.
template <typename See>
void each_sample(const GstVideoInfo& info, GstBuffer* buffer, GstMapFlags flags, See see) {
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
}

// A textured ground, a square that moves across it, and noise.
Frame make_frame(const GstVideoInfo& info, int t) {
  Frame frame;
  for (guint c = 0; c < GST_VIDEO_INFO_N_COMPONENTS(&info); ++c) {
    Component of{GST_VIDEO_INFO_COMP_WIDTH(&info, c), GST_VIDEO_INFO_COMP_HEIGHT(&info, c), {}};
    const int columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, c);
    const int rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, c);
    for (int y = 0; y < of.height; ++y)
      for (int x = 0; x < of.width; ++x) {
        const int left = 5 * t % 40, px = x * columns, py = y * rows;
        const bool inside = px >= left && px < left + 9 && py >= 2 && py < 12;
        int sample = 60 + static_cast<int>(30 * c) + (7 * x + 3 * y) % 50;
        if (inside) sample = 230 - static_cast<int>(50 * c);
        if (c == 3) sample = 255 - (x + y) % 90;
        of.samples.push_back(static_cast<uint8_t>(sample + (x * 31 + y * 17 + t * 13) % 3));
      }
    frame.push_back(std::move(of));
  }
  return frame;
}

// Each sample for all pixels that share it.
Frame expand(const GstVideoInfo& info, const Frame& frame) {
  Frame all;
  for (guint c = 0; c < frame.size(); ++c) {
    Component of{GST_VIDEO_INFO_WIDTH(&info), GST_VIDEO_INFO_HEIGHT(&info), {}};
    for (int y = 0; y < of.height; ++y)
      for (int x = 0; x < of.width; ++x)
        of.samples.push_back(frame[c].at(x >> GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, c),
                                         y >> GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, c)));
    all.push_back(std::move(of));
  }
  return all;
}

// The mean of the pixels that share a sample, rounded.
Frame reduce(const GstVideoInfo& info, const Frame& frame) {
  Frame all;
  for (guint c = 0; c < frame.size(); ++c) {
    const int columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, c);
    const int rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, c);
    Component of{GST_VIDEO_INFO_COMP_WIDTH(&info, c), GST_VIDEO_INFO_COMP_HEIGHT(&info, c), {}};
    for (int top = 0; top < frame[c].height; top += rows)
      for (int left = 0; left < frame[c].width; left += columns) {
        int sum = 0, count = 0;
        for (int y = top; y < std::min(top + rows, frame[c].height); ++y)
          for (int x = left; x < std::min(left + columns, frame[c].width); ++x, ++count)
            sum += frame[c].at(x, y);
        of.samples.push_back(static_cast<uint8_t>((sum + count / 2) / count));
      }
    all.push_back(std::move(of));
  }
  return all;
}

// Strides with room behind rows, planes with room between them, and an offset.
BufferPtr padded_buffer(const GstVideoInfo& info) {
  gsize offset[GST_VIDEO_MAX_PLANES] = {}, size = 48;
  gint stride[GST_VIDEO_MAX_PLANES] = {};
  for (guint plane = 0; plane < GST_VIDEO_INFO_N_PLANES(&info); ++plane) {
    gint component[GST_VIDEO_MAX_COMPONENTS];
    gst_video_format_info_component(info.finfo, plane, component);
    offset[plane] = size;
    stride[plane] = GST_VIDEO_INFO_PLANE_STRIDE(&info, plane) + 24 + 16 * static_cast<gint>(plane);
    size += static_cast<gsize>(stride[plane]) *
                static_cast<gsize>(GST_VIDEO_INFO_COMP_HEIGHT(&info, component[0])) +
            33;
  }
  BufferPtr buffer(gst_buffer_new_allocate(nullptr, size, nullptr));
  gst_buffer_memset(buffer.get(), 0, 0xa5, size);
  gst_buffer_add_video_meta_full(buffer.get(), GST_VIDEO_FRAME_FLAG_NONE,
                                 GST_VIDEO_INFO_FORMAT(&info),
                                 static_cast<guint>(GST_VIDEO_INFO_WIDTH(&info)),
                                 static_cast<guint>(GST_VIDEO_INFO_HEIGHT(&info)),
                                 GST_VIDEO_INFO_N_PLANES(&info), offset, stride);
  return buffer;
}

std::vector<Frame> run(const std::string& properties, const GstVideoInfo& info,
                       const std::vector<Frame>& frames, bool padded = false) {
  GstHarness* harness = gst_harness_new_parse(("qdmdbackground " + properties).c_str());
  gst_harness_set_src_caps(harness, gst_video_info_to_caps(&info));
  for (size_t t = 0; t < frames.size(); ++t) {
    BufferPtr buffer = padded ? padded_buffer(info)
                              : BufferPtr(gst_buffer_new_allocate(nullptr, info.size, nullptr));
    if (!padded) gst_buffer_memset(buffer.get(), 0, 0x5a, info.size);
    GST_BUFFER_PTS(buffer.get()) = t * kFrame;
    GST_BUFFER_DURATION(buffer.get()) = kFrame;
    each_sample(info, buffer.get(), GST_MAP_WRITE,
                [&](guint c, int x, int y, uint8_t* sample) { *sample = frames[t][c].at(x, y); });
    EXPECT_EQ(GST_FLOW_OK, gst_harness_push(harness, buffer.release()));
  }
  EXPECT_TRUE(gst_harness_push_event(harness, gst_event_new_eos()));
  std::vector<Frame> out;
  while (GstBuffer* pulled = gst_harness_try_pull(harness)) {
    const BufferPtr buffer(pulled);
    Frame frame;
    for (guint c = 0; c < GST_VIDEO_INFO_N_COMPONENTS(&info); ++c)
      frame.push_back(
          {GST_VIDEO_INFO_COMP_WIDTH(&info, c), GST_VIDEO_INFO_COMP_HEIGHT(&info, c), {}});
    each_sample(info, buffer.get(), GST_MAP_READ, [&](guint c, int, int, const uint8_t* sample) {
      frame[c].samples.push_back(*sample);
    });
    out.push_back(std::move(frame));
  }
  gst_harness_teardown(harness);
  return out;
}

void expect_equal(const std::vector<Frame>& expected, const std::vector<Frame>& seen) {
  ASSERT_EQ(expected.size(), seen.size());
  for (size_t t = 0; t < seen.size(); ++t)
    for (size_t c = 0; c < seen[t].size(); ++c)
      ASSERT_EQ(expected[t][c].samples, seen[t][c].samples) << "frame " << t << " component " << c;
}

constexpr std::array kFormats = {
    GST_VIDEO_FORMAT_I420, GST_VIDEO_FORMAT_YV12, GST_VIDEO_FORMAT_NV12, GST_VIDEO_FORMAT_NV21,
    GST_VIDEO_FORMAT_Y42B, GST_VIDEO_FORMAT_NV16, GST_VIDEO_FORMAT_YUY2, GST_VIDEO_FORMAT_UYVY,
    GST_VIDEO_FORMAT_Y444, GST_VIDEO_FORMAT_AYUV, GST_VIDEO_FORMAT_A420};

class YuvFormats : public testing::TestWithParam<const char*> {};

TEST_P(YuvFormats, AreThePlainReferenceAtAnySizeAndStride) {
  const std::string properties =
      std::string("window-size=6 foreground-threshold=20 output=") + GetParam();
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 1}, {1, 2}, {3, 5}, {16, 9}, {61, 31}, {134, 34}})
    for (GstVideoFormat format : kFormats)
      for (bool live : {false, true}) {
        SCOPED_TRACE(std::string(gst_video_format_to_string(format)) + " " + std::to_string(width) +
                     "x" + std::to_string(height) + (live ? " live" : ""));
        const GstVideoInfo info = info_of(format, width, height);
        const GstVideoInfo plain =
            info_of(GST_VIDEO_INFO_HAS_ALPHA(&info) ? GST_VIDEO_FORMAT_AYUV : GST_VIDEO_FORMAT_Y444,
                    width, height);
        std::vector<Frame> in, expanded, expected;
        for (int t = 0; t < kFrames; ++t) {
          in.push_back(make_frame(info, t));
          expanded.push_back(expand(info, in.back()));
        }
        const std::string all = properties + (live ? " mode=live hop-size=2" : "");
        for (const Frame& frame : run(all, plain, expanded))
          expected.push_back(reduce(info, frame));
        ASSERT_EQ(static_cast<size_t>(kFrames), expected.size());
        for (bool padded : {false, true}) expect_equal(expected, run(all, info, in, padded));
        if (testing::Test::HasFailure()) return;
      }
}

INSTANTIATE_TEST_SUITE_P(Outputs, YuvFormats,
                         testing::Values("background", "foreground", "mask", "cutout",
                                         "cutout mask-softness=3", "mask shadows=marked"),
                         [](const auto& suite) {
                           std::string name = suite.param;
                           for (char& letter : name)
                             if (!g_ascii_isalnum(letter)) letter = '_';
                           return name;
                         });

// The reference itself: Y, U and V are three channels as R, G and B are.
TEST(YuvFormats, FullColourIsWhatPlanesOfRgbAre) {
  const GstVideoInfo yuv = info_of(GST_VIDEO_FORMAT_Y444, 61, 31),
                     rgb = info_of(GST_VIDEO_FORMAT_GBR, 61, 31, GST_VIDEO_COLOR_RANGE_0_255);
  std::vector<Frame> in;
  for (int t = 0; t < kFrames; ++t) in.push_back(make_frame(yuv, t));
  for (const char* more : {"", " mode=live", " method=qdmd", " method=dmd"})
    expect_equal(run(std::string("window-size=6") + more, rgb, in),
                 run(std::string("window-size=6") + more, yuv, in));
}

// What black, white and neutral are, by format and range.
struct Shades {
  GstVideoFormat format;
  GstVideoColorRange range;
  int black, white, neutral;
};

class Ranges : public testing::TestWithParam<Shades> {};

TEST_P(Ranges, DecideWhatBlackAndWhiteAre) {
  const Shades& shades = GetParam();
  const GstVideoInfo info = info_of(shades.format, 64, 32, shades.range);
  std::vector<Frame> in;
  for (int t = 0; t < kFrames; ++t) in.push_back(make_frame(info, t));
  const auto of = [&](const char* output) {
    return run(std::string("window-size=10 output=") + output, info, in);
  };
  const auto mask = of("mask"), cutout = of("cutout"), foreground = of("foreground"),
             background = of("background");
  int white = 0, black = 0;
  for (size_t t = 0; t < in.size(); ++t) {
    // Where chroma is that of pixels in and out, it is something in between.
    for (size_t i = 0; i < mask[t][0].samples.size(); ++i) {
      const int m = mask[t][0].samples[i];
      ASSERT_TRUE(m == shades.black || m == shades.white) << m;
      white += m == shades.white, black += m == shades.black;
      ASSERT_EQ(cutout[t][0].samples[i], m == shades.white ? in[t][0].samples[i] : shades.black);
      ASSERT_EQ(foreground[t][0].samples[i],
                std::min(shades.black + std::abs(in[t][0].samples[i] - background[t][0].samples[i]),
                         shades.white));
    }
    if (!GST_VIDEO_INFO_IS_YUV(&info)) continue;
    for (size_t c : {size_t{1}, size_t{2}})
      for (size_t i = 0; i < mask[t][c].samples.size(); ++i) {
        ASSERT_EQ(shades.neutral, mask[t][c].samples[i]);
        ASSERT_EQ(shades.neutral, foreground[t][c].samples[i]);
      }
  }
  EXPECT_GT(white, 100);
  EXPECT_GT(black, 10 * white);
}

INSTANTIATE_TEST_SUITE_P(
    Formats, Ranges,
    testing::Values(Shades{GST_VIDEO_FORMAT_I420, GST_VIDEO_COLOR_RANGE_16_235, 16, 235, 128},
                    Shades{GST_VIDEO_FORMAT_I420, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 128},
                    Shades{GST_VIDEO_FORMAT_NV12, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 128},
                    Shades{GST_VIDEO_FORMAT_YUY2, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 128},
                    Shades{GST_VIDEO_FORMAT_AYUV, GST_VIDEO_COLOR_RANGE_16_235, 16, 235, 128},
                    Shades{GST_VIDEO_FORMAT_GRAY8, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 0},
                    Shades{GST_VIDEO_FORMAT_GRAY8, GST_VIDEO_COLOR_RANGE_16_235, 16, 235, 0},
                    Shades{GST_VIDEO_FORMAT_RGB, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 0},
                    Shades{GST_VIDEO_FORMAT_RGBx, GST_VIDEO_COLOR_RANGE_16_235, 16, 235, 0}),
    [](const auto& suite) {
      return std::string(gst_video_format_to_string(suite.param.format)) + "_" +
             (suite.param.range == GST_VIDEO_COLOR_RANGE_0_255 ? "full" : "limited");
    });

}  // namespace
}  // namespace qdmd::test
