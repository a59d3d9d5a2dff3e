// SPDX-License-Identifier: LGPL-2.1-or-later
// The measures of background pictures and masks: values worked out by hand, and slow versions with
// explicit loops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>

#include "core/metrics/mask_scores.h"
#include "core/metrics/msssim.h"
#include "core/metrics/picture_scores.h"

namespace qdmd::test {
namespace {

// A packed picture of its own.
struct Rgb {
  int width, height;
  std::vector<uint8_t> bytes;

  Rgb(int width_, int height_, std::vector<uint8_t> bytes_ = {})
      : width(width_), height(height_), bytes(std::move(bytes_)) {
    bytes.resize(3 * static_cast<size_t>(width) * static_cast<size_t>(height));
  }
  ImageView view() const {
    ImageView view;
    for (int c = 0; c < 3; ++c) view.channel[c] = bytes.data() + c;
    view.width = width;
    view.height = height;
    view.pixel_stride = 3;
    view.row_stride = 3 * width;
    return view;
  }
};

Rgb random_picture(int width, int height, unsigned seed) {
  Rgb picture(width, height);
  std::mt19937 rng(seed);
  for (auto& byte : picture.bytes) byte = static_cast<uint8_t>(rng());
  return picture;
}

Plane<uint8_t> plane_of(int width, int height, const std::function<int(int x, int y)>& value) {
  Plane<uint8_t> plane(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) plane.at(x, y) = static_cast<uint8_t>(value(x, y));
  return plane;
}

// Waves under noise, and the same with other noise: similar but not equal.
Plane<uint8_t> noisy_waves(int width, int height, unsigned seed, int noise) {
  std::mt19937 rng(seed);
  return plane_of(width, height, [&](int x, int y) {
    const double wave = 128 + 60 * std::sin(0.21 * x) * std::cos(0.13 * y + 0.05 * x);
    return std::clamp(static_cast<int>(wave) + static_cast<int>(rng() % (2 * noise + 1)) - noise, 0,
                      255);
  });
}

// ---- Channels ----

TEST(Luma, HasTheValuesOfTheStandard) {
  // Black, white, red, green, blue in BT.601: 16, 235, 81.481, 144.553, 40.966.
  const Rgb picture(5, 1, {0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255});
  EXPECT_EQ(luma(picture.view()).values, (std::vector<uint8_t>{16, 235, 81, 145, 41}));
}

TEST(ReversibleYuv, RoundsDownAndKeepsSigns) {
  const Rgb picture(2, 1, {10, 21, 31, 255, 0, 7});
  const ReversibleYuv yuv = reversible_yuv(picture.view());
  EXPECT_EQ(yuv.y.values, (std::vector<int>{20, 65}));  // 83 / 4, 262 / 4
  EXPECT_EQ(yuv.u.values, (std::vector<int>{-11, 255}));
  EXPECT_EQ(yuv.v.values, (std::vector<int>{10, 7}));
}

TEST(Luma, FollowsStrides) {
  // Two rows of two BGRx pixels with four bytes of padding.
  std::vector<uint8_t> bytes(2 * 12, 200);
  const auto set = [&](size_t at, uint8_t r, uint8_t g, uint8_t b) {
    bytes[at] = b, bytes[at + 1] = g, bytes[at + 2] = r;
  };
  set(0, 0, 0, 0), set(4, 255, 0, 0), set(12, 0, 255, 0), set(16, 0, 0, 255);
  ImageView view;
  for (int c = 0; c < 3; ++c) view.channel[c] = bytes.data() + 2 - c;
  view.width = view.height = 2;
  view.pixel_stride = 4;
  view.row_stride = 12;
  EXPECT_EQ(luma(view).values, (std::vector<uint8_t>{16, 81, 145, 41}));
}

// ---- All six ----

TEST(PictureScores, IdenticalPicturesHaveTheBestValues) {
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 200}, {15, 15}, {17, 31}, {200, 180}}) {
    const Rgb picture = random_picture(width, height, 5);
    const PictureScores scores = score_picture(picture.view(), picture.view());
    EXPECT_EQ(scores.age, 0);
    EXPECT_EQ(scores.peps, 0);
    EXPECT_EQ(scores.pceps, 0);
    EXPECT_DOUBLE_EQ(scores.msssim, 1) << width << "x" << height;
    EXPECT_EQ(scores.psnr, 100);
    EXPECT_DOUBLE_EQ(scores.cqm, 100);
  }
}

TEST(PictureScores, APictureShiftedByTenLevels) {
  // Grey v has luma 16 + 219 v / 255: 100 gives 101.88, 110 gives 110.47; 0 gives 16, 10 gives
  // 24.59; 30 gives 41.76, 40 gives 50.35. Rounded, they differ by 8, 9 and 8.
  const Rgb before(3, 1, {100, 100, 100, 0, 0, 0, 30, 30, 30});
  const Rgb after(3, 1, {110, 110, 110, 10, 10, 10, 40, 40, 40});
  const PictureScores scores = score_picture(after.view(), before.view());
  EXPECT_DOUBLE_EQ(scores.age, 25.0 / 3);
  EXPECT_EQ(scores.peps, 0);
  EXPECT_EQ(scores.pceps, 0);
  const double psnr_y = 10 * std::log10(65025 / ((64 + 81 + 64) / 3.0));
  EXPECT_DOUBLE_EQ(scores.psnr, psnr_y);
  // Y' is shifted by exactly 10; U' and V' are 0 in both, whose PSNR is the cap.
  EXPECT_DOUBLE_EQ(scores.cqm, 0.9449 * 10 * std::log10(65025 / 100.0) + 0.0551 * 100);
}

TEST(PictureScores, DifferentSizesAreNamed) {
  const Rgb small(4, 3), large(4, 5);
  try {
    score_picture(small.view(), large.view());
    FAIL() << "sizes that differ were scored";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "the background has 4x3 pixels, but the truth has 4x5");
  }
  EXPECT_THROW(msssim(Plane<uint8_t>(2, 3), Plane<uint8_t>(3, 2)), std::invalid_argument);
  EXPECT_THROW(error_pixels(Plane<uint8_t>(2, 3), Plane<uint8_t>(3, 2)), std::invalid_argument);
  EXPECT_THROW(score_picture(Rgb(0, 0).view(), Rgb(0, 0).view()), std::invalid_argument);
}

TEST(PictureScores, OnePixel) {
  const Rgb black(1, 1, {0, 0, 0}), white(1, 1, {255, 255, 255});
  const PictureScores scores = score_picture(black.view(), white.view());
  EXPECT_EQ(scores.age, 219);
  EXPECT_EQ(scores.peps, 1);
  EXPECT_EQ(scores.pceps, 1);
  EXPECT_DOUBLE_EQ(scores.psnr, 10 * std::log10(65025 / (219.0 * 219.0)));
  // Only the brightness term of the fifth scale is left.
  const double c1 = 2.55 * 2.55;
  EXPECT_DOUBLE_EQ(scores.msssim,
                   std::pow((2 * 16 * 235 + c1) / (16.0 * 16 + 235.0 * 235 + c1), 0.1333));
}

// ---- Error pixels ----

TEST(ErrorPixels, TwentyLevelsAreNoError) {
  const auto base = plane_of(4, 1, [](int, int) { return 100; });
  const auto other = plane_of(4, 1, [](int x, int) { return std::vector{120, 121, 80, 79}[x]; });
  EXPECT_DOUBLE_EQ(error_pixels(base, other).all, 0.5);
}

TEST(ErrorPixels, ClustersAreAnErosionByADiamond) {
  const char* const rows[] = {"......##",  //
                              ".#.....#",  //
                              "###.....",  //
                              "####...#",  //
                              "###.....",  //
                              ".#......"};
  const auto base = plane_of(8, 6, [](int, int) { return 50; });
  const auto other = plane_of(8, 6, [&](int x, int y) { return rows[y][x] == '#' ? 200 : 50; });
  const ErrorPixels errors = error_pixels(base, other);
  EXPECT_DOUBLE_EQ(errors.all, 16.0 / 48);
  // (1,2), (1,3), (1,4), (2,3); and (0,3), (7,0), whose neighbours inside the picture all are.
  EXPECT_DOUBLE_EQ(errors.clustered, 6.0 / 48);
}

// ---- MS-SSIM ----

// By the definition, pixel by pixel, with a two-dimensional window.
double slow_msssim(const Plane<uint8_t>& a, const Plane<uint8_t>& b) {
  using Real = std::vector<std::vector<double>>;  // [y][x]
  const auto real = [](const Plane<uint8_t>& p) {
    Real out(static_cast<size_t>(p.height), std::vector<double>(static_cast<size_t>(p.width)));
    for (int y = 0; y < p.height; ++y)
      for (int x = 0; x < p.width; ++x) out[y][x] = p.at(x, y);
    return out;
  };
  const auto half = [](const Real& p) {
    const size_t height = p.size(), width = p[0].size();
    Real out((height + 1) / 2, std::vector<double>((width + 1) / 2));
    for (size_t y = 0; y < out.size(); ++y)
      for (size_t x = 0; x < out[0].size(); ++x) {
        const size_t y1 = std::min(2 * y + 1, height - 1), x1 = std::min(2 * x + 1, width - 1);
        out[y][x] = (p[2 * y][2 * x] + p[2 * y][x1] + p[y1][2 * x] + p[y1][x1]) / 4;
      }
    return out;
  };
  const int shorter = std::min(a.width, a.height);
  const size_t side = shorter >= 176 ? 11 : shorter >= 16 ? static_cast<size_t>(shorter) / 16 : 1;
  Real window(side, std::vector<double>(side));
  double sum = 0;
  const double middle = (static_cast<double>(side) - 1) / 2;
  for (size_t i = 0; i < side; ++i)
    for (size_t j = 0; j < side; ++j) {
      const double dy = static_cast<double>(i) - middle, dx = static_cast<double>(j) - middle;
      sum += window[i][j] = std::exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5));
    }

  const double weights[] = {0.0448, 0.2856, 0.3001, 0.2363, 0.1333};
  const double c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
  Real p = real(a), q = real(b);
  double product = 1;
  for (int scale = 0; scale < 5; ++scale) {
    if (scale > 0) p = half(p), q = half(q);
    double sum_ssim = 0, sum_cs = 0;
    int places = 0;
    for (size_t y = 0; y + side <= p.size(); ++y)
      for (size_t x = 0; x + side <= p[0].size(); ++x, ++places) {
        double mu_p = 0, mu_q = 0, var_p = 0, var_q = 0, cov = 0;
        const auto each = [&](const std::function<void(double, double, double)>& see) {
          for (size_t i = 0; i < side; ++i)
            for (size_t j = 0; j < side; ++j)
              see(window[i][j] / sum, p[y + i][x + j], q[y + i][x + j]);
        };
        each([&](double w, double u, double v) { mu_p += w * u, mu_q += w * v; });
        each([&](double w, double u, double v) {
          var_p += w * (u - mu_p) * (u - mu_p);
          var_q += w * (v - mu_q) * (v - mu_q);
          cov += w * (u - mu_p) * (v - mu_q);
        });
        const double cs = (2 * cov + c2) / (var_p + var_q + c2);
        sum_cs += cs;
        sum_ssim += cs * (2 * mu_p * mu_q + c1) / (mu_p * mu_p + mu_q * mu_q + c1);
      }
    const double mean = (scale < 4 ? sum_cs : sum_ssim) / places;
    product *= mean > 0 ? std::pow(mean, weights[scale]) : 0;
  }
  return product;
}

TEST(Msssim, EqualsTheSlowVersion) {
  // From 176 px on the window has 11 px, at 161 px an even number, below 16 px one.
  for (const auto& [width, height] : {std::pair{190, 177},
                                      {176, 200},
                                      {161, 190},
                                      {97, 64},
                                      {33, 81},
                                      {16, 16},
                                      {15, 40},
                                      {2, 3},
                                      {1, 1}}) {
    const auto a = noisy_waves(width, height, 1, 20), b = noisy_waves(width, height, 2, 30);
    const double expected = slow_msssim(a, b);
    EXPECT_NEAR(msssim(a, b), expected, 1e-9) << width << "x" << height;
    EXPECT_GT(expected, 0.1);
    EXPECT_LT(expected, 1);
  }
}

TEST(Msssim, WindowSidesOfTheRule) {
  EXPECT_EQ(msssim_window(640, 480), 11);
  EXPECT_EQ(msssim_window(500, 176), 11);
  EXPECT_EQ(msssim_window(175, 500), 10);
  EXPECT_EQ(msssim_window(200, 136), 8);
  EXPECT_EQ(msssim_window(16, 16), 1);
  EXPECT_EQ(msssim_window(15, 900), 1);
  EXPECT_EQ(msssim_window(1, 1), 1);
}

TEST(Msssim, NegativesOfEachOtherCountAsZero) {
  const auto picture = noisy_waves(180, 180, 3, 40);
  const auto negative = plane_of(180, 180, [&](int x, int y) { return 255 - picture.at(x, y); });
  EXPECT_EQ(msssim(picture, negative), 0);
}

TEST(Msssim, FallsWithNoise) {
  const auto truth = noisy_waves(200, 180, 4, 0);
  double before = 1;
  for (int noise : {5, 15, 45}) {
    const double now = msssim(truth, noisy_waves(200, 180, 5, noise));
    EXPECT_LT(now, before) << noise;
    before = now;
  }
}

// ---- PSNR and CQM ----

TEST(Psnr, OneLevelEverywhere) {
  const auto a = plane_of(7, 5, [](int x, int) { return x; });
  const auto b = plane_of(7, 5, [](int x, int) { return x + 1; });
  EXPECT_DOUBLE_EQ(psnr(a, b), 20 * std::log10(255.0));
}

TEST(Psnr, NoPairScoresBetterThanIdenticalPictures) {
  // One level at one of a million pixels would be 108 dB.
  auto a = plane_of(1000, 1000, [](int, int) { return 9; });
  const auto b = a;
  a.at(500, 500) = 10;
  EXPECT_EQ(psnr(a, b), 100);
}

TEST(Cqm, WeighsTheThreeChannels) {
  // Y' 66 and 65, U' -20 and -10, V' 20 and 21.
  const Rgb a(1, 1, {46, 66, 86}), b(1, 1, {53, 63, 84});
  ASSERT_EQ(reversible_yuv(a.view()).y.values[0], 66);
  ASSERT_EQ(reversible_yuv(b.view()).y.values[0], 65);
  const auto db = [](double difference) { return 20 * std::log10(255 / difference); };
  EXPECT_NEAR(colour_quality(a.view(), b.view()), 0.9449 * db(1) + 0.0551 * (db(10) + db(1)) / 2,
              1e-12);
}

// ---- Masks ----

TEST(MaskCounts, FollowCdnetsLabels) {
  const uint8_t labels[] = {0, 0, 50, 50, 85, 85, 170, 170, 255, 255, 255};
  const uint8_t mask[] = {0, 255, 0, 255, 0, 255, 0, 255, 0, 255, 1};
  MaskCounts counts;
  counts.add(mask, labels, std::size(mask));
  EXPECT_EQ(counts.true_positive, 2u);
  EXPECT_EQ(counts.false_negative, 1u);
  EXPECT_EQ(counts.false_positive, 2u);  // one of them in shadow
  EXPECT_EQ(counts.true_negative, 2u);
  EXPECT_DOUBLE_EQ(counts.precision().value(), 2.0 / 4);
  EXPECT_DOUBLE_EQ(counts.recall().value(), 2.0 / 3);
  EXPECT_DOUBLE_EQ(counts.f_measure().value(), 2 * 0.5 * (2.0 / 3) / (0.5 + 2.0 / 3));
}

TEST(MaskCounts, AreSumsOverFrames) {
  const uint8_t white[] = {255, 255}, black[] = {0, 0};
  MaskCounts counts;
  counts.add(white, white, 2);
  counts.add(white, black, 2);
  counts.add(black, white, 2);
  EXPECT_DOUBLE_EQ(counts.precision().value(), 0.5);
  EXPECT_DOUBLE_EQ(counts.recall().value(), 0.5);
  EXPECT_DOUBLE_EQ(counts.f_measure().value(), 0.5);
}

TEST(MaskCounts, HaveNoRatioOfNothing) {
  const uint8_t black[] = {0, 0}, outside[] = {85, 170}, white[] = {255, 255};
  MaskCounts nothing;
  nothing.add(white, outside, 2);
  nothing.add(black, black, 2);
  EXPECT_FALSE(nothing.precision() || nothing.recall() || nothing.f_measure());
  MaskCounts missed;
  missed.add(black, white, 2);
  EXPECT_FALSE(missed.precision());
  EXPECT_EQ(missed.recall().value(), 0);
  EXPECT_EQ(missed.f_measure().value(), 0);
}

TEST(MaskCounts, OtherLabelsAreAnErrorThatCountsNothing) {
  const uint8_t labels[] = {255, 1}, mask[] = {255, 255};
  MaskCounts counts;
  EXPECT_THROW(counts.add(mask, labels, 2), std::invalid_argument);
  EXPECT_EQ(counts.true_positive, 0u);
}

}  // namespace
}  // namespace qdmd::test
