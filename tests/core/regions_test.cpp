// SPDX-License-Identifier: LGPL-2.1-or-later
// Boxes around foreground: joined, merged, counted, and left out where they are small.
#include "core/foreground/regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

namespace qdmd::test {
namespace {

struct Mask {
  int width, height;
  std::vector<uint8_t> white, residual;

  Mask(int width_, int height_)
      : width(width_),
        height(height_),
        white(static_cast<size_t>(width * height)),
        residual(white.size()) {}
  void box(int x, int y, int w, int h, uint8_t level) {
    for (int yy = y; yy < y + h; ++yy)
      for (int xx = x; xx < x + w; ++xx) {
        white[static_cast<size_t>(yy * width + xx)] = 255;
        residual[static_cast<size_t>(yy * width + xx)] = level;
      }
  }
  std::vector<Region> regions(int least_area = 0) const {
    RegionFinder finder;
    return regions(&finder, least_area);
  }
  std::vector<Region> regions(RegionFinder* finder, int least_area = 0) const {
    return finder->find(white.data(), residual.data(), width, height, least_area);
  }
};

void expect_box(const Region& region, int x, int y, int w, int h) {
  EXPECT_EQ(region.x, x);
  EXPECT_EQ(region.y, y);
  EXPECT_EQ(region.width, w);
  EXPECT_EQ(region.height, h);
}

TEST(Regions, AreTightBoxesTheLargestFirst) {
  Mask mask(320, 240);
  mask.box(10, 20, 10, 30, 60);
  mask.box(200, 100, 40, 50, 90);
  const auto regions = mask.regions();
  ASSERT_EQ(regions.size(), 2u);
  expect_box(regions[0], 200, 100, 40, 50);
  EXPECT_EQ(regions[0].area, 2000);
  EXPECT_DOUBLE_EQ(regions[0].mean_residual, 90);
  expect_box(regions[1], 10, 20, 10, 30);
}

// Feet that a threshold cut off belong to their legs.
TEST(Regions, PartsThatAreNearAreOne) {
  Mask mask(320, 240);
  mask.box(50, 50, 20, 30, 100);
  mask.box(50, 83, 20, 10, 40);
  const auto regions = mask.regions();
  ASSERT_EQ(regions.size(), 1u);
  expect_box(regions[0], 50, 50, 20, 43);
  EXPECT_EQ(regions[0].area, 800);
  EXPECT_DOUBLE_EQ(regions[0].mean_residual, (600 * 100 + 200 * 40) / 800.0);
  // Farther away, they are two.
  mask.box(50, 110, 20, 10, 40);
  EXPECT_EQ(mask.regions().size(), 2u);
}

// 5 pixels are as far as parts reach here, along a row, along a column and in both.
TEST(Regions, PartsReachAsFarAsTheySay) {
  for (const int gap : {5, 6})
    for (const auto& [x, y] : {std::pair{gap, 0}, {-gap, 0}, {0, gap}, {gap, gap}, {-gap, gap}}) {
      Mask mask(320, 240);
      mask.box(100, 100, 1, 1, 60);
      mask.box(100 + x, 100 + y, 1, 1, 60);
      EXPECT_EQ(mask.regions(1).size(), gap == 5 ? 1u : 2u) << x << ", " << y;
    }
}

// A frame around something else: boxes overlap though nothing touches. What has grown by it
// overlaps a third.
TEST(Regions, OverlappingBoxesAreMerged) {
  Mask mask(320, 240);
  mask.box(100, 100, 60, 4, 80);
  mask.box(100, 100, 4, 60, 80);
  mask.box(130, 130, 12, 12, 50);
  mask.box(150, 155, 40, 12, 50);
  mask.box(250, 30, 20, 20, 70);
  const auto regions = mask.regions();
  ASSERT_EQ(regions.size(), 2u);
  expect_box(regions[0], 100, 100, 90, 67);
  EXPECT_EQ(regions[0].area, 60 * 4 + 56 * 4 + 144 + 480);
  expect_box(regions[1], 250, 30, 20, 20);
}

// Something that comes in is a strip at first, which says little of it.
TEST(Regions, StripsAlongAnEdgeAreLeftOut) {
  for (const auto& [x, y, w, h] : {std::tuple{318, 100, 2, 30},
                                   {0, 100, 4, 60},
                                   {40, 0, 90, 2},
                                   {40, 236, 90, 4},
                                   {0, 0, 320, 3},
                                   {0, 0, 3, 240}}) {
    SCOPED_TRACE(testing::Message() << x << " " << y << " " << w << "x" << h);
    Mask mask(320, 240);
    mask.box(x, y, w, h, 90);
    EXPECT_TRUE(mask.regions().empty());
    EXPECT_EQ(mask.regions(4).size(), 1u);  // The user wants small ones.
    // As narrow, but not at an edge; and at the edge, but wider.
    Mask other(320, 240);
    other.box(100, 20, std::min(w, 200), std::min(h, 200), 90);
    EXPECT_EQ(other.regions().size(), 1u);
    Mask wider(320, 240);
    const int width = std::max(w, 10), height = std::max(h, 10);
    wider.box(std::min(x, 320 - width), std::min(y, 240 - height), width, height, 90);
    EXPECT_EQ(wider.regions().size(), 1u);
  }
  // A picture that is as narrow has two edges.
  Mask narrow(2, 40);
  narrow.box(0, 0, 2, 40, 90);
  EXPECT_EQ(narrow.regions().size(), 1u);
}

TEST(Regions, SmallOnesAreLeftOut) {
  Mask mask(320, 240);
  mask.box(10, 10, 5, 5, 60);
  mask.box(100, 100, 8, 8, 60);
  // 1/2000 of the picture are 38 pixels.
  EXPECT_EQ(mask.regions().size(), 1u);
  EXPECT_EQ(mask.regions(25).size(), 2u);
  EXPECT_EQ(mask.regions(26).size(), 1u);
  EXPECT_EQ(mask.regions(65).size(), 0u);
}

TEST(Regions, OfEverythingNothingAndOnePixel) {
  EXPECT_TRUE(Mask(320, 240).regions().empty());
  EXPECT_TRUE(Mask(320, 240).regions(1).empty());
  Mask all(64, 48);
  all.box(0, 0, 64, 48, 255);
  ASSERT_EQ(all.regions().size(), 1u);
  expect_box(all.regions()[0], 0, 0, 64, 48);
  Mask pixel(1, 1);
  EXPECT_TRUE(pixel.regions(1).empty());
  pixel.box(0, 0, 1, 1, 9);
  ASSERT_EQ(pixel.regions(1).size(), 1u);
  expect_box(pixel.regions(1)[0], 0, 0, 1, 1);
}

TEST(Regions, AreNotCountless) {
  Mask mask(1280, 960);
  for (int y = 4; y < 940; y += 40)
    for (int x = 4; x < 1240; x += 40) mask.box(x, y, 3, 3, 50);
  EXPECT_EQ(mask.regions(1).size(), RegionFinder::kMostRegions);
}

// Parts by flooding, pixel after pixel, before boxes that overlap are merged.
std::vector<Region> flooded(const Mask& mask) {
  const int reach =
      2 * std::max(1, int(std::lround(std::min(mask.width, mask.height) / 120.0))) + 1;
  std::vector<Region> found;
  std::vector<uint8_t> seen(mask.white.size());
  for (int start = 0; start < mask.width * mask.height; ++start) {
    if (seen[size_t(start)] || !mask.white[size_t(start)]) continue;
    std::vector<int> part = {start};
    seen[size_t(start)] = 1;
    int left = INT32_MAX, right = 0, top = INT32_MAX, bottom = 0, sum = 0;
    for (size_t i = 0; i < part.size(); ++i) {
      const int x = part[i] % mask.width, y = part[i] / mask.width;
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
      sum += mask.residual[size_t(part[i])];
      for (int yy = std::max(0, y - reach); yy <= std::min(mask.height - 1, y + reach); ++yy)
        for (int xx = std::max(0, x - reach); xx <= std::min(mask.width - 1, x + reach); ++xx) {
          const auto at = size_t(yy * mask.width + xx);
          if (seen[at] || !mask.white[at]) continue;
          seen[at] = 1;
          part.push_back(int(at));
        }
    }
    const int area = int(part.size());
    found.push_back({left, top, right - left + 1, bottom - top + 1, area, double(sum) / area});
  }
  return found;
}

// Merges until no boxes overlap any more, where the order does not matter.
std::vector<Region> merged(std::vector<Region> regions) {
  for (size_t i = 0; i < regions.size(); ++i)
    for (size_t k = 0; k < i; ++k) {
      Region &a = regions[k], &b = regions[i];
      const int left = std::min(a.x, b.x), right = std::max(a.x + a.width, b.x + b.width);
      const int top = std::min(a.y, b.y), bottom = std::max(a.y + a.height, b.y + b.height);
      if (right - left >= a.width + b.width || bottom - top >= a.height + b.height) continue;
      const double sum = a.area * a.mean_residual + b.area * b.mean_residual;
      a = {left, top, right - left, bottom - top, a.area + b.area, sum / (a.area + b.area)};
      regions.erase(regions.begin() + ptrdiff_t(i));
      return merged(std::move(regions));
    }
  std::sort(regions.begin(), regions.end(), [](const Region& a, const Region& b) {
    return std::tuple(-a.area, a.y, a.x) < std::tuple(-b.area, b.y, b.x);
  });
  return regions;
}

TEST(Regions, AreFoundByFlooding) {
  std::mt19937 rng(77);
  size_t alone = 0, joined = 0;
  for (auto [width, height] : {std::pair{1, 1}, {40, 1}, {1, 40}, {97, 64}, {320, 240}, {300, 700}})
    for (int turn = 0; turn < 30; ++turn) {
      // Boxes of a few pixels, and long ones, in whose corners others lie.
      Mask mask(width, height);
      const int boxes = 1 + width * height / 4000 * (turn % 10);
      for (int k = 0; k < boxes; ++k) {
        const bool tall = k % 4 == 0, wide = k % 4 == 1;
        const int w = 1 + int(rng() % (wide ? 90 : 9)), h = 1 + int(rng() % (tall ? 90 : 9));
        const int x = int(rng() % unsigned(width)), y = int(rng() % unsigned(height));
        mask.box(x, y, std::min(w, width - x), std::min(h, height - y), uint8_t(rng() % 256));
      }
      const auto parts = flooded(mask);
      if (parts.size() > RegionFinder::kMostRegions) continue;
      const auto expected = merged(parts), found = mask.regions(1);
      ASSERT_EQ(found.size(), expected.size()) << width << "x" << height;
      for (size_t k = 0; k < found.size(); ++k) {
        const Region& region = expected[k];
        expect_box(found[k], region.x, region.y, region.width, region.height);
        ASSERT_EQ(found[k].area, region.area);
        // Means of means are rounded in another order.
        ASSERT_NEAR(found[k].mean_residual, region.mean_residual, 1e-9);
      }
      alone += found.size();
      joined += parts.size() - found.size();
    }
  EXPECT_GT(alone, 500u);
  EXPECT_GT(joined, 50u);
}

// Nothing of one picture is left in the next, whatever its size.
TEST(Regions, OfOnePictureAfterAnother) {
  Mask many(320, 240), one(320, 240), small(40, 30);
  for (int k = 0; k < 5; ++k) many.box(10 + 60 * k, 20, 20, 30 + k, 60);
  one.box(100, 100, 30, 30, 90);
  small.box(3, 4, 10, 12, 30);
  RegionFinder finder;
  for (const Mask* mask : {&many, &one, &small, &many, &small, &one}) {
    const auto expected = mask->regions(), found = mask->regions(&finder);
    ASSERT_EQ(found.size(), expected.size());
    for (size_t k = 0; k < found.size(); ++k) {
      const Region& region = expected[k];
      expect_box(found[k], region.x, region.y, region.width, region.height);
      EXPECT_EQ(found[k].area, region.area);
      EXPECT_EQ(found[k].mean_residual, region.mean_residual);
    }
  }
}

}  // namespace
}  // namespace qdmd::test
