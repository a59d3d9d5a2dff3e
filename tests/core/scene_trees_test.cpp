// SPDX-License-Identifier: LGPL-2.1-or-later
// Trees near the camera: how much they hide, how they sway, and that everybody is behind them.
#include <algorithm>
#include <set>

#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

constexpr int kWidth = 160, kHeight = 120;
constexpr size_t kPixels = size_t{kWidth} * kHeight;

bool same_pixel(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b, size_t i) {
  return std::equal(&a[3 * i], &a[3 * i] + 3, &b[3 * i]);
}

std::vector<uint8_t> still_street() {
  Scene scene(options(kWidth, kHeight), "default");
  return shoot(&scene, 0).background;
}

TEST(SceneTrees, HangInTheirShareOfThePicture) {
  for (const double share : {0.1, 0.33, 0.7, 1.0})
    for (uint64_t seed = 0; seed < 3; ++seed) {
      Scene plain(options(kWidth, kHeight, 25, seed), "default"),
          scene(options(kWidth, kHeight, 25, seed), "trees=" + std::to_string(share));
      const auto behind = shoot(&plain, 0).background;
      std::vector<bool> hidden(kPixels);
      for (int64_t k = 0; k < 200; k += 4) {
        const Shot shot = shoot(&scene, k, scene::kTruth);
        for (size_t i = 0; i < kPixels; ++i)
          hidden[i] = hidden[i] || !same_pixel(shot.background, behind, i);
      }
      const auto seen = static_cast<double>(std::count(hidden.begin(), hidden.end(), true));
      // The outer boughs swing to both sides by 3 % of the width.
      EXPECT_NEAR(seen / kPixels, share, 0.05) << seed;
    }
}

TEST(SceneTrees, APixelSeesLeavesAndWhatIsBehind) {
  const auto street = still_street();
  Scene scene(options(kWidth, kHeight), "trees");
  std::vector<std::set<int>> colours(kPixels);
  for (int64_t k = 0; k < 500; k += 5) {
    const Shot shot = shoot(&scene, k, scene::kTruth);
    for (size_t i = 0; i < kPixels; ++i)
      colours[i].insert(same_pixel(shot.background, street, i) ? -1 : shot.background[3 * i + 1]);
  }
  size_t leaves = 0, gaps = 0, several = 0;
  for (const auto& levels : colours) {
    const size_t looks = levels.size() - levels.count(-1);
    leaves += looks > 0, gaps += looks > 0 && levels.count(-1) > 0, several += looks >= 4;
  }
  EXPECT_GT(leaves, kPixels / 4);
  EXPECT_GT(gaps, leaves / 2);
  EXPECT_GT(several, leaves / 2);
}

// Mean difference of two frames' boughs in levels, in a box where every pixel may be a leaf; `b` is
// looked at beside its place.
double difference(const Shot& a, const Shot& b, const scene::Box& box, int dx, int dy) {
  double sum = 0;
  for (int y = box.y; y < box.bottom(); ++y)
    for (int x = box.x; x < box.right(); ++x)
      sum += std::abs(a.background[static_cast<size_t>(y * kWidth + x) * 3 + 1] -
                      b.background[static_cast<size_t>((y + dy) * kWidth + x + dx) * 3 + 1]);
  return sum / (box.width * box.height);
}

// The difference that is left where one shift of the whole box explains most.
double least_difference(const Shot& a, const Shot& b, const scene::Box& box) {
  double least = 1e9;
  for (int dy = -5; dy <= 5; ++dy)
    for (int dx = -10; dx <= 10; ++dx) least = std::min(least, difference(a, b, box, dx, dy));
  return least;
}

TEST(SceneTrees, SwayTogetherInTimeButNotAsOne) {
  constexpr scene::Box kAll{12, 12, 24, 48};
  Scene scene(options(kWidth, kHeight, 50), "trees");
  double next = 0, later = 0, together = 0, apart = 0;
  for (int64_t k = 0; k < 1000; k += 50) {
    const Shot now = shoot(&scene, k, scene::kTruth), soon = shoot(&scene, k + 1, scene::kTruth),
               second = shoot(&scene, k + 37, scene::kTruth);
    next += difference(now, soon, kAll, 0, 0), later += difference(now, second, kAll, 0, 0);
    together += least_difference(now, second, kAll);
    for (int i = 0; i < 8; ++i)
      apart += least_difference(now, second, {12 + 12 * (i % 2), 12 + 12 * (i / 2), 12, 12}) / 8;
  }
  EXPECT_GT(next, 0);
  EXPECT_GT(later, 3 * next);
  // No shift of all boughs explains what the wind did (measured 0.98; boughs that swing as one have
  // 0.71), shifts of small parts do better (0.85 and 0.98).
  EXPECT_GT(together, 0.85 * later);
  EXPECT_LT(apart, 0.92 * together);

  Scene calm(options(kWidth, kHeight), "trees:amplitude=0");
  const Shot first = shoot(&calm, 0, scene::kTruth);
  EXPECT_NE(first.background, still_street());
  for (const int64_t k : {1, 50, 1000})
    EXPECT_EQ(shoot(&calm, k, scene::kTruth).background, first.background);
}

TEST(SceneTrees, EverybodyIsBehindThem) {
  // A van that stands there and drives off, shadows and mirror images, sharp and blurred by motion.
  for (const char* others : {"bootstrap=6,remove=3,shadow:softness=2,mirror",
                             "bootstrap=6,remove=3,shadow,motion-blur=1"}) {
    Scene scene(options(kWidth, kHeight, 5), std::string(others) + ",trees"),
        without(options(kWidth, kHeight, 5), others), trees(options(kWidth, kHeight, 5), "trees"),
        street(options(kWidth, kHeight, 5), "default");
    size_t hidden = 0, between = 0;
    for (int64_t k = 0; k < 40; ++k) {
      const Shot all = shoot(&scene, k), objects = shoot(&without, k);
      const Shot leaves = shoot(&trees, k, scene::kTruth), empty = shoot(&street, k, scene::kTruth);
      EXPECT_EQ(all.boxes, objects.boxes);
      for (size_t i = 0; i < kPixels; ++i) {
        if (same_pixel(leaves.background, empty.background, i)) {
          // A leaf of what is behind's own colour hides something all the same.
          between += all.labels[i] != 0 && i % kWidth < kWidth / 4;
          continue;
        }
        hidden += objects.labels[i] != 0;
        ASSERT_EQ(all.labels[i], scene::kBackgroundLabel) << k;
        ASSERT_TRUE(same_pixel(all.frame, leaves.background, i)) << k;
        ASSERT_TRUE(same_pixel(all.background, leaves.background, i)) << k;
      }
    }
    EXPECT_GT(hidden, 5000u) << others;
    EXPECT_GT(between, 500u) << others;
  }
}

TEST(SceneTrees, ALargerCanvasHasTheSameLeaves) {
  Scene narrow(options(kWidth, kHeight), "trees"), wide(options(kWidth, kHeight), "trees,water=7");
  for (int64_t k = 0; k < 200; k += 20) {
    const Shot a = shoot(&narrow, k), b = shoot(&wide, k);
    // The canal is the lowest tenth.
    const auto rows = static_cast<ptrdiff_t>(kWidth) * 3 * (kHeight * 9 / 10);
    EXPECT_TRUE(std::equal(a.frame.begin(), a.frame.begin() + rows, b.frame.begin())) << k;
  }
}

}  // namespace
}  // namespace qdmd::test
