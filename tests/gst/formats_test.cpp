// SPDX-License-Identifier: LGPL-2.1-or-later
// Y, U and V in every layout against a plain reference: each sample given to the pixels that share
// it, the element on these, and the mean of what comes out. The same of all depths.
#include <array>
#include <cmath>

#include "tests/gst/video_frames.h"

namespace qdmd::test {
namespace {

constexpr std::array kFormats = {
    GST_VIDEO_FORMAT_I420, GST_VIDEO_FORMAT_YV12, GST_VIDEO_FORMAT_NV12, GST_VIDEO_FORMAT_NV21,
    GST_VIDEO_FORMAT_Y42B, GST_VIDEO_FORMAT_NV16, GST_VIDEO_FORMAT_YUY2, GST_VIDEO_FORMAT_UYVY,
    GST_VIDEO_FORMAT_Y444, GST_VIDEO_FORMAT_AYUV, GST_VIDEO_FORMAT_A420};

constexpr std::array kDeepFormats = {GST_VIDEO_FORMAT_I420_10LE, GST_VIDEO_FORMAT_I422_10LE,
                                     GST_VIDEO_FORMAT_P010_10LE, GST_VIDEO_FORMAT_I420_12LE,
                                     GST_VIDEO_FORMAT_I422_12LE, GST_VIDEO_FORMAT_P012_LE,
                                     GST_VIDEO_FORMAT_P016_LE};

// The format with samples of that kind in which each pixel has its own.
GstVideoFormat plain_format(const GstVideoInfo& info) {
  switch (GST_VIDEO_INFO_COMP_DEPTH(&info, 0)) {
    case 10:
      return GST_VIDEO_FORMAT_Y444_10LE;
    case 12:
      return GST_VIDEO_FORMAT_Y444_12LE;
    case 16:
      return GST_VIDEO_FORMAT_Y444_16LE;
    default:
      return GST_VIDEO_INFO_HAS_ALPHA(&info) ? GST_VIDEO_FORMAT_AYUV : GST_VIDEO_FORMAT_Y444;
  }
}

class YuvFormats : public testing::TestWithParam<const char*> {};

template <typename Formats>
void expect_plain_reference(const Formats& formats, const std::string& output) {
  const std::string properties = "window-size=6 foreground-threshold=20 output=" + output;
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 1}, {1, 2}, {3, 5}, {16, 9}, {61, 31}, {134, 34}})
    for (GstVideoFormat format : formats)
      for (bool live : {false, true}) {
        SCOPED_TRACE(std::string(gst_video_format_to_string(format)) + " " + std::to_string(width) +
                     "x" + std::to_string(height) + (live ? " live" : ""));
        const GstVideoInfo info = info_of(format, width, height);
        const GstVideoInfo plain = info_of(plain_format(info), width, height);
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

TEST_P(YuvFormats, AreThePlainReferenceAtAnySizeAndStride) {
  expect_plain_reference(kFormats, GetParam());
}

// Methods, too: chroma is spread in another way than that of 8 bits.
TEST_P(YuvFormats, OfMoreThan8BitsAreItByAnyMethod) {
  for (const char* method : {"", " method=qdmd", " method=dmd"})
    expect_plain_reference(kDeepFormats, GetParam() + std::string(method));
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

// The reference itself: Y, U and V are three channels as R, G and B are. Not for `robust`, which
// knows what light does to each.
TEST(YuvFormats, FullColourIsWhatPlanesOfRgbAre) {
  const GstVideoInfo yuv = info_of(GST_VIDEO_FORMAT_Y444, 61, 31),
                     rgb = info_of(GST_VIDEO_FORMAT_GBR, 61, 31, GST_VIDEO_COLOR_RANGE_0_255);
  std::vector<Frame> in;
  for (int t = 0; t < kFrames; ++t) in.push_back(make_frame(yuv, t));
  for (const char* more : {" method=qdmd", " method=dmd"})
    expect_equal(run(std::string("window-size=6") + more, rgb, in),
                 run(std::string("window-size=6") + more, yuv, in));
}

// Layouts have one set of samples in another order; and in grey all channels are equal.
TEST(DeepFormats, DifferInTheirLayoutOnly) {
  for (const auto& [width, height] : {std::pair{1, 1}, {61, 31}, {134, 34}})
    for (bool padded : {false, true})
      for (const char* output :
           {"background", "foreground", "mask", "cutout", "cutout mask-softness=3"})
        for (const char* more : {"", " mode=live", " method=qdmd", " method=dmd"}) {
          const std::string properties =
              std::string("window-size=6 foreground-threshold=20 ") + "output=" + output + more;
          SCOPED_TRACE(properties);
          const auto info = [width = width, height = height](GstVideoFormat format) {
            return info_of(format, width, height);
          };
          const GstVideoInfo rgba = info(GST_VIDEO_FORMAT_RGBA64_LE),
                             argb = info(GST_VIDEO_FORMAT_ARGB64),
                             grey = info(GST_VIDEO_FORMAT_GRAY16_LE);
          std::vector<Frame> in, of_grey, in_grey;
          for (int t = 0; t < kFrames; ++t) {
            in.push_back(make_frame(rgba, t));
            of_grey.push_back(make_frame(grey, t));
            in_grey.push_back(
                {of_grey.back()[0], of_grey.back()[0], of_grey.back()[0], of_grey.back()[0]});
            for (auto& sample : in_grey.back()[3].samples) sample = 65535;
          }
          expect_equal(run(properties, rgba, in), run(properties, argb, in, padded));
          // Light is nothing that grey knows of: masks differ.
          if (std::strcmp(output, "background") != 0 && std::strcmp(output, "foreground") != 0)
            continue;
          // Grey is the last of three channels, which rounding tells apart.
          std::vector<Frame> seen;
          for (const Frame& frame : run(properties, rgba, in_grey)) seen.push_back({frame[2]});
          expect_equal(seen, run(properties, grey, of_grey, padded));
          if (testing::Test::HasFailure()) return;
        }
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
    testing::Values(
        Shades{GST_VIDEO_FORMAT_I420, GST_VIDEO_COLOR_RANGE_16_235, 16, 235, 128},
        Shades{GST_VIDEO_FORMAT_I420, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 128},
        Shades{GST_VIDEO_FORMAT_NV12, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 128},
        Shades{GST_VIDEO_FORMAT_YUY2, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 128},
        Shades{GST_VIDEO_FORMAT_AYUV, GST_VIDEO_COLOR_RANGE_16_235, 16, 235, 128},
        Shades{GST_VIDEO_FORMAT_GRAY8, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 0},
        Shades{GST_VIDEO_FORMAT_GRAY8, GST_VIDEO_COLOR_RANGE_16_235, 16, 235, 0},
        Shades{GST_VIDEO_FORMAT_RGB, GST_VIDEO_COLOR_RANGE_0_255, 0, 255, 0},
        Shades{GST_VIDEO_FORMAT_I420_10LE, GST_VIDEO_COLOR_RANGE_16_235, 64, 940, 512},
        Shades{GST_VIDEO_FORMAT_P010_10LE, GST_VIDEO_COLOR_RANGE_0_255, 0, 1023, 512},
        Shades{GST_VIDEO_FORMAT_I420_12LE, GST_VIDEO_COLOR_RANGE_16_235, 256, 3760, 2048},
        Shades{GST_VIDEO_FORMAT_Y444_16LE, GST_VIDEO_COLOR_RANGE_0_255, 0, 65535, 32768},
        Shades{GST_VIDEO_FORMAT_GRAY16_LE, GST_VIDEO_COLOR_RANGE_0_255, 0, 65535, 0},
        Shades{GST_VIDEO_FORMAT_RGBA64_LE, GST_VIDEO_COLOR_RANGE_0_255, 0, 65535, 0},
        Shades{GST_VIDEO_FORMAT_RGBx, GST_VIDEO_COLOR_RANGE_16_235, 16, 235, 0}),
    [](const auto& suite) {
      return std::string(gst_video_format_to_string(suite.param.format)) + "_" +
             (suite.param.range == GST_VIDEO_COLOR_RANGE_0_255 ? "full" : "limited");
    });

}  // namespace
}  // namespace qdmd::test
