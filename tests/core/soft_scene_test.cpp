// SPDX-License-Identifier: LGPL-2.1-or-later
// Soft masks on simulated scenes: how much outlines that stand still change from frame to frame.
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/engine/engine.h"
#include "core/scene/scene.h"
#include "gtest/gtest.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 320, kHeight = 240, kWindow = 60, kFrames = 110;
constexpr size_t kPixels = size_t{kWidth} * kHeight;
// Pixels around one that have to be what they were, and in which there has to be an outline.
constexpr int kNear = 7;

template <typename Byte>
BasicImageView<Byte> view_of(Byte* rgb) {
  BasicImageView<Byte> view;
  for (int c = 0; c < 3; ++c) view.channel[c] = rgb + c;
  view.width = kWidth, view.height = kHeight;
  view.pixel_stride = 3, view.row_stride = 3 * kWidth;
  return view;
}

// From one frame to the next, near outlines that the truth says stand still.
struct Change {
  double pixels = 0;    // looked at
  double absolute = 0;  // sum of changes, 1: black to white
  double squared = 0;
};

Change change_of(const std::string& text, int softness) {
  scene::SceneOptions scene_options;
  scene_options.width = kWidth, scene_options.height = kHeight;
  scene_options.seed = 3;
  scene::Scene scene(scene_options, text);
  EngineOptions options;
  options.window_size = kWindow;
  options.mask_softness = softness;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  std::vector<std::vector<uint8_t>> labels;
  std::vector<uint8_t> mask(3 * kPixels), before;
  Change change;
  size_t popped = 0;
  const auto compare = [&](const std::vector<uint8_t>& was, const std::vector<uint8_t>& is) {
    for (int y = kNear; y < kHeight - kNear; y += 2)
      for (int x = kNear; x < kWidth - kNear; x += 2) {
        bool still = true, inside = false, outside = false;
        for (int dy = -kNear; still && dy <= kNear; ++dy) {
          const size_t row = static_cast<size_t>((y + dy) * kWidth + x - kNear);
          for (size_t p = row; p <= row + 2 * kNear; ++p) {
            still &= was[p] == is[p];
            (is[p] == scene::kObjectLabel ? inside : outside) = true;
          }
        }
        if (!still || !inside || !outside) continue;
        const auto p = static_cast<size_t>(y * kWidth + x);
        const double moved = (mask[3 * p] - before[3 * p]) / 255.0;
        ++change.pixels;
        change.absolute += std::abs(moved);
        change.squared += moved * moved;
      }
  };
  const auto pop = [&] {
    for (; engine.next(); ++popped) {
      before = mask;
      engine.next()->pop(Output::mask, view_of(mask.data()));
      if (popped > 10) compare(labels[popped - 1], labels[popped]);
    }
  };
  for (int t = 0; t < kFrames; ++t) {
    scene.render(t, scene::kFrame | scene::kLabels);
    labels.push_back(scene.labels().samples);
    EXPECT_TRUE(engine.push(view_of(std::as_const(scene.frame()).samples.data())).ok());
    pop();
  }
  EXPECT_TRUE(engine.drain().ok());
  pop();
  return change;
}

// A bag that somebody left. Where the hard mask hardly changes, the soft one does by less than half
// a level.
TEST(SoftMask, IsSteadierThanTheHardOne) {
  for (const char* scene : {"basic,abandon", "basic,abandon,noise=6"}) {
    SCOPED_TRACE(scene);
    const Change hard = change_of(scene, 0), soft = change_of(scene, 2);
    ASSERT_GT(hard.pixels, 1000);
    ASSERT_EQ(soft.pixels, hard.pixels);
    EXPECT_LT(soft.absolute, 0.8 * hard.absolute + 0.5 / 255 * hard.pixels);
    EXPECT_LT(soft.squared, 0.6 * hard.squared);
  }
}

}  // namespace
}  // namespace qdmd::test
