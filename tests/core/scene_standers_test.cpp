// SPDX-License-Identifier: LGPL-2.1-or-later
// People who come and stand, and people who stand there and leave: where, when, and what is true.
#include <algorithm>

#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Box;
using scene::Scene;

constexpr int kWidth = 320, kHeight = 240;

// The boxes that two frames of one scene have in common: of whoever stands.
std::vector<Box> still_boxes(Scene* scene, int64_t first, int64_t second) {
  const std::vector<Box> a = shoot(scene, first, scene::kBoxes).boxes,
                         b = shoot(scene, second, scene::kBoxes).boxes;
  std::vector<Box> still;
  for (const Box& box : a)
    if (std::find(b.begin(), b.end(), box) != b.end()) still.push_back(box);
  return still;
}

TEST(SceneStand, PersonsComeStandAndGo) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const auto how = options(kWidth, kHeight, 25, seed);
    Scene scene(how, "stand=5:from=8:seconds=4"), plain(how, "default");
    // A frame's width takes 5 s: nobody is there in the beginning, and nobody in the end.
    EXPECT_TRUE(shoot(&scene, 0) == shoot(&plain, 0)) << seed;
    EXPECT_TRUE(shoot(&scene, 18 * 25) == shoot(&plain, 18 * 25)) << seed;
    const std::vector<Box> standing = still_boxes(&scene, 8 * 25, 12 * 25 - 1);
    EXPECT_EQ(standing.size(), 5u) << seed;
    for (const int64_t k : {8 * 25 - 3, 12 * 25 + 2}) {
      const std::vector<Box> boxes = shoot(&scene, k, scene::kBoxes).boxes;
      for (const Box& box : standing)
        EXPECT_EQ(std::count(boxes.begin(), boxes.end(), box), 0) << seed << " frame " << k;
    }
    // They are foreground all the time.
    for (int64_t k = 0; k < 18 * 25; k += 9)
      EXPECT_EQ(shoot(&scene, k, scene::kTruth).background,
                shoot(&plain, k, scene::kTruth).background);
  }
}

TEST(SceneStand, NobodyStandsBeforeAnotherOneWhileThereIsRoom) {
  for (uint64_t seed = 0; seed < 30; ++seed) {
    Scene scene(options(kWidth, kHeight, 25, seed), "stand=6");
    const std::vector<Box> standing = still_boxes(&scene, 100, 200);
    EXPECT_EQ(standing.size(), 6u) << seed;
    for (size_t i = 0; i < standing.size(); ++i)
      for (size_t k = 0; k < i; ++k)
        EXPECT_TRUE(scene::intersection(standing[i], standing[k]).empty()) << seed;
  }
}

TEST(SceneStand, BusyPlacesHaveMoreContrastThanPlainOnes) {
  double busy = 0, plain = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const scene::Backdrop backdrop(kWidth, kHeight, 0, scene::StreamSource(seed, "backdrop"));
    const auto contrast = [&](const char* text) {
      Scene scene(options(kWidth, kHeight, 25, seed), text);
      double sum = 0;
      const std::vector<Box> standing = still_boxes(&scene, 100, 200);
      for (const Box& box : standing)
        sum += backdrop.contrast(box) / static_cast<double>(standing.size());
      return sum;
    };
    busy += contrast("stand=3:busy=1") / 20, plain += contrast("stand=3:busy=0") / 20;
  }
  EXPECT_GT(busy, 1.5 * plain);
}

TEST(SceneLeave, PersonsAreBackgroundUntilTheyGo) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const auto how = options(kWidth, kHeight, 25, seed);
    Scene scene(how, "leave=5:at=3"), plain(how, "default");
    const Shot there = shoot(&scene, 0);
    for (int64_t k = 0; k < 75; k += 5) {
      const Shot shot = shoot(&scene, k), without = shoot(&plain, k);
      EXPECT_EQ(shot.background, there.background) << k;
      EXPECT_NE(shot.background, without.background) << k;
      EXPECT_EQ(shot.labels, without.labels) << k;
      EXPECT_EQ(shot.boxes, without.boxes) << k;
    }
    for (int64_t k = 75; k < 210; k += 5) {
      const Shot shot = shoot(&scene, k), without = shoot(&plain, k);
      EXPECT_EQ(shot.background, without.background) << k;
      EXPECT_GE(shot.boxes.size(), without.boxes.size()) << k;
    }
    EXPECT_EQ(shoot(&scene, 75).boxes.size(), shoot(&plain, 75).boxes.size() + 5) << seed;
    EXPECT_TRUE(shoot(&scene, 210) == shoot(&plain, 210)) << seed;
  }
}

}  // namespace
}  // namespace qdmd::test
