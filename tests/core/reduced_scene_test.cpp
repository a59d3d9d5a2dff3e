// SPDX-License-Identifier: LGPL-2.1-or-later
// Masks of simulated scenes that are found in a smaller picture, beside those of all pixels.
#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/engine/engine.h"
#include "core/foreground/regions.h"
#include "core/scene/scene.h"
#include "gtest/gtest.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 641, kHeight = 481, kFrames = 70, kFirst = 20;

struct Seen {
  double f = 0;                              // of all pixels from frame kFirst on
  std::vector<std::vector<Region>> regions;  // of each frame
};

Seen look(const char* text, int scale, Mode mode) {
  scene::SceneOptions scene_options;
  scene_options.width = kWidth, scene_options.height = kHeight;
  scene_options.seed = 5;
  scene::Scene scene(scene_options, text);
  EngineOptions options;
  options.mode = mode;
  options.window_size = 60;
  options.mask_scale = scale;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  constexpr size_t kPixels = size_t{kWidth} * kHeight;
  std::vector<std::vector<uint8_t>> labels;
  std::vector<uint8_t> mask(kPixels), residual(kPixels);
  RegionFinder finder;
  Seen seen;
  size_t t = 0;
  double hits = 0, wrong = 0;
  const auto leave = [&] {
    while (LeavingFrame* const frame = engine.next()) {
      frame->foreground(mask.data(), residual.data());
      seen.regions.push_back(finder.find(mask.data(), residual.data(), kWidth, kHeight, 300, true));
      for (size_t p = 0; t >= kFirst && p < kPixels; ++p) {
        const bool object = labels[t][p] == scene::kObjectLabel;
        hits += object && mask[p];
        wrong += object != (mask[p] != 0);
      }
      ++t;
      frame->skip();
    }
  };
  for (int i = 0; i < kFrames; ++i) {
    scene.render(i, scene::kFrame | scene::kLabels);
    labels.push_back(scene.labels().samples);
    const uint8_t* const rgb = scene.frame().samples.data();
    ImageView view;
    for (int c = 0; c < 3; ++c) view.channel[c] = rgb + c;
    view.width = kWidth, view.height = kHeight;
    view.pixel_stride = 3, view.row_stride = ptrdiff_t{3} * kWidth;
    EXPECT_TRUE(engine.push(view).ok());
    leave();
  }
  EXPECT_TRUE(engine.drain().ok());
  leave();
  seen.f = 2 * hits / (2 * hits + wrong);
  return seen;
}

class ReducedScene : public testing::TestWithParam<std::tuple<Mode, const char*>> {};

TEST_P(ReducedScene, IsHardlyWorse) {
  const auto& [mode, text] = GetParam();
  const Seen whole = look(text, 1, mode), reduced = look(text, 2, mode);
  // Half of the pixels along edges of things that are sharp to a pixel.
  EXPECT_GT(reduced.f, whole.f - 0.015) << whole.f;
  ASSERT_EQ(whole.regions.size(), reduced.regions.size());
  int compared = 0, apart = 0;
  for (size_t t = kFirst; t < whole.regions.size(); ++t)
    for (const Region& one : whole.regions[t]) {
      // Things that touch may be one in one of the masks.
      ++compared;
      const auto near = [&](const Region& other) {
        const int right = one.x + one.width - other.x - other.width,
                  below = one.y + one.height - other.y - other.height;
        return std::max({std::abs(one.x - other.x), std::abs(one.y - other.y), std::abs(right),
                         std::abs(below)}) <= 3;
      };
      const auto& others = reduced.regions[t];
      apart += std::none_of(others.begin(), others.end(), near);
    }
  EXPECT_GE(compared, 50);
  EXPECT_LE(apart, compared / 10) << "of " << compared;
}

INSTANTIATE_TEST_SUITE_P(Scenes, ReducedScene,
                         testing::Combine(testing::Values(Mode::batch, Mode::live),
                                          testing::Values("basic", "basic,noise=4")));

}  // namespace
}  // namespace qdmd::test
