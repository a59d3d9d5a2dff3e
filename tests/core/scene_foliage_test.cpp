// SPDX-License-Identifier: LGPL-2.1-or-later
// Leaves before the camera: how much they hide, of which colours they are, and when they move.
#include <algorithm>
#include <map>
#include <numeric>

#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

constexpr int kWidth = 160, kHeight = 120;

// Samples at pixels of a part of a picture, in row order.
std::vector<uint8_t> part(const std::vector<uint8_t>& samples, int left, int top, int right,
                          int bottom) {
  const int channels = static_cast<int>(samples.size()) / (kWidth * kHeight);
  std::vector<uint8_t> result;
  for (int y = top; y < bottom; ++y)
    result.insert(result.end(), samples.begin() + (y * kWidth + left) * channels,
                  samples.begin() + (y * kWidth + right) * channels);
  return result;
}

// The share of a part's pixels that differ.
double differing(const Shot& shot, const Shot& other, int left, int top, int right, int bottom) {
  const auto a = part(shot.frame, left, top, right, bottom),
             b = part(other.frame, left, top, right, bottom);
  size_t count = 0;
  for (size_t i = 0; i < a.size(); i += 3) count += !std::equal(&a[i], &a[i] + 3, &b[i]);
  return static_cast<double>(count) / static_cast<double>(a.size() / 3);
}

TEST(SceneFoliage, HidesWhatItIsToldTo) {
  Scene plain(options(kWidth, kHeight), "default");
  for (int share : {40, 70})
    for (int cover : {30, 60, 80}) {
      Scene scene(options(kWidth, kHeight), "foliage=" + std::to_string(share) + ":cover=" +
                                                std::to_string(cover) + ":size=12:wind=3");
      const int edge = kWidth * share / 100;
      double covered = 0;
      for (int64_t k = 0; k < 200; k += 20) {
        const Shot shot = shoot(&scene, k), without = shoot(&plain, k);
        covered += differing(shot, without, 8, 8, edge - 8, kHeight - 8) / 10;
        // Half a leaf of 12 % and the wind's 3.6 % of the picture's side.
        EXPECT_EQ(differing(shot, without, edge + 16, 0, kWidth, kHeight), 0);
        for (size_t p = 0; p < shot.labels.size(); ++p) {
          const uint8_t* const pixel = &shot.frame[3 * p];
          const bool leaf = !std::equal(pixel, pixel + 3, &without.frame[3 * p]);
          ASSERT_TRUE(!leaf || shot.labels[p] == 255) << p;
        }
      }
      // Small leaves overlap less than leaves at random places would.
      EXPECT_GT(covered, cover / 100.0 - 0.05) << share;
      EXPECT_LT(covered, cover / 100.0 + 0.2) << share;
    }
}

// A leaf that turns catches another light, and is as green as before.
TEST(SceneFoliage, LeavesKeepTheirHue) {
  Scene scene(options(4 * kWidth, 4 * kHeight), "foliage=100:cover=90");
  // Red over green and blue over green of bright pixels, whose rounding is small.
  std::map<std::pair<int, int>, int> hues;
  int seen = 0;
  for (int64_t k = 0; k < 20; ++k) {
    const Shot shot = shoot(&scene, 25 * k, scene::kFrame | scene::kLabels);
    for (size_t p = 0; p < shot.labels.size(); ++p) {
      const uint8_t* const x = &shot.frame[3 * p];
      if (shot.labels[p] != 255 || *std::min_element(x, x + 3) < 40 ||
          *std::max_element(x, x + 3) > 250)
        continue;
      ++seen;
      ++hues[{static_cast<int>(std::lround(30.0 * x[0] / x[1])),
              static_cast<int>(std::lround(30.0 * x[2] / x[1]))}];
    }
  }
  std::vector<int> counts;
  for (const auto& [hue, count] : hues) counts.push_back(count);
  std::sort(counts.rbegin(), counts.rend());
  // Twelve shapes have a colour each, which rounding spreads over neighbouring bins.
  const auto most = std::accumulate(
      counts.begin(), counts.begin() + std::min<ptrdiff_t>(24, std::ssize(counts)), 0);
  ASSERT_GT(seen, 100000);
  EXPECT_GT(most, 0.98 * seen);
}

// How far leaves come out of their part of the picture says how far they move.
TEST(SceneFoliage, ReachesAsFarAsTheWindTakesIt) {
  Scene plain(options(kWidth, kHeight), "default");
  constexpr int kEdge = kWidth * 40 / 100, kHalfLeaf = 9;
  const auto covered = [&](const std::string& wind, int left, int right) {
    Scene scene(options(kWidth, kHeight), "foliage=40:size=12" + wind);
    double share = 0;
    for (int64_t k = 0; k < 200; k += 20)
      share += differing(shoot(&scene, k), shoot(&plain, k), left, 0, right, kHeight) / 10;
    return share;
  };
  constexpr int kNear = kEdge + kHalfLeaf + 1, kFar = kNear + 30;
  EXPECT_EQ(covered(":wind=0", kNear, kWidth), 0);
  // At most 1.2 times 10 % of a side of 139 pixels.
  EXPECT_GT(covered(":wind=10", kNear, kNear + 10), 0.02);
  EXPECT_EQ(covered(":wind=10", kNear + 17, kWidth), 0);
  // 40 % where nothing is said.
  EXPECT_GT(covered("", kFar, kFar + 10), 0.02);
  EXPECT_EQ(covered("", kFar, kWidth), covered(":wind=40", kFar, kWidth));
}

TEST(SceneFoliage, RestsInTheUpperLeftCornerOnly) {
  Scene scene(options(kWidth, kHeight), "foliage=100:size=6:wind=6:rest=4");
  const Shot first = shoot(&scene, 0, scene::kFrame);
  const auto corner = [&](const Shot& shot) { return differing(shot, first, 0, 0, 30, 26); };
  // All but where leaves from beside it come.
  for (int64_t k : {30, 60, 99}) {
    const Shot shot = shoot(&scene, k, scene::kFrame);
    EXPECT_EQ(corner(shot), 0) << k;
    EXPECT_GT(differing(shot, first, 64, 0, kWidth, 34), 0.5) << k;
    EXPECT_GT(differing(shot, first, 0, 56, 30, kHeight), 0.5) << k;
  }
  EXPECT_GT(corner(shoot(&scene, 100, scene::kFrame)), 0.5);
}

}  // namespace
}  // namespace qdmd::test
