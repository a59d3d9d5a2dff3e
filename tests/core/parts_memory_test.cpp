// SPDX-License-Identifier: LGPL-2.1-or-later
// What each part of the core promises to take is what it takes: of these sums a whole engine's
// promise is made (memory_test), where one part's mistake may be too small to be seen.
#include <functional>
#include <string>

#include "core/align/motion.h"
#include "core/align/restorer.h"
#include "core/foreground/moving_texture.h"
#include "core/foreground/pixel_noise.h"
#include "core/foreground/soft_mask.h"
#include "core/foreground/specks.h"
#include "core/learn/robust/clutter.h"
#include "core/learn/robust/history_starts.h"
#include "core/learn/robust/light.h"
#include "core/learn/robust/scene_watch.h"
#include "core/learn/robust/stable_frames.h"
#include "core/learn/robust/standing_looks.h"
#include "core/passes/fill.h"
#include "core/passes/grid.h"
#include "core/passes/patch_density.h"
#include "core/planes/snapshot_range.h"
#include "tests/core/allocator.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// What stands for a few vectors and rows of one thread, where a promise leaves them out.
constexpr int64_t kLittle = 4096;

// The most bytes at any time in `work`.
int64_t taken_by(const std::function<void()>& work) {
  allocator::start();
  work();
  allocator::stop();
  return allocator::seen().peak;
}

void expect(const char* part, uint64_t promised, const std::function<void()>& make,
            int64_t little = 0) {
  SCOPED_TRACE(part);
  const int64_t taken = taken_by(make);
  EXPECT_LE(taken, static_cast<int64_t>(promised) + little);
  EXPECT_GE(taken, static_cast<int64_t>(promised));
}

struct Size {
  int width, height;
  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

class PartsMemory : public testing::TestWithParam<Size> {
 protected:
  void SetUp() override {
    if (!allocator::sees_all()) GTEST_SKIP() << "no allocator of our own";
  }
};

TEST_P(PartsMemory, OfAPicture) {
  const int width = GetParam().width, height = GetParam().height;
  const Grid grid(width, height);
  expect("SceneWatch", SceneWatch::bytes(grid), [&] { SceneWatch part(grid); });
  expect("StandingLooks", StandingLooks::bytes(grid), [&] { StandingLooks part(grid); });
  expect("HistoryStarts", HistoryStarts::bytes(grid.cells()),
         [&] { HistoryStarts part(grid.cells()); });
  expect("LightScratch", LightScratch::bytes(grid.cells()),
         [&] { LightScratch part(grid.cells()); });
  expect("Restorer", Restorer::bytes(width, height), [&] { Restorer part(width, height); });
  expect("Restorer of more than 8 bits", Restorer::bytes(width, height, 10),
         [&] { Restorer part(width, height, 10); });
  constexpr int kLooks = 9;
  const GridFrames frames(grid, kLooks);
  const GridPictures looks(frames);
  const std::vector<int> from(grid.cells(), 1);
  const std::vector<float> density(kLooks * grid.cells(), 1.0f);
  Pool pool(1);
  expect("ClutterColours", ClutterColours::bytes(grid, kLooks, 1), [&] {
    ClutterColours part(grid, looks, kLooks, &pool);
    for (int round = 0; round < 2; ++round) {
      part.learn(from);
      part.weigh(density);
    }
  });
  expect("PixelNoise", PixelNoise::bytes(width, height), [&] { PixelNoise part(width, height); });
  expect("SoftMask", SoftMask::bytes(width, height), [&] { SoftMask part(width, height); });
  expect("Specks", Specks::bytes(width, height), [&] { Specks part(width, height); });
  expect(
      "MotionFinder", MotionFinder::bytes(width, height), [&] { MotionFinder part(width, height); },
      kLittle);
  expect(
      "MovingTexture", MovingTexture::bytes(width, height),
      [&] { MovingTexture part(width, height); }, kLittle);
}

TEST_P(PartsMemory, OfAWindow) {
  const Grid grid(GetParam().width, GetParam().height);
  const size_t pixels = GetParam().pixels();
  Pool pool(1);
  for (const int snapshots : {1, 2, 100}) {
    SCOPED_TRACE(std::to_string(snapshots) + " snapshots");
    const auto count = static_cast<uint64_t>(snapshots);
    expect("Filler", Filler<uint8_t>::bytes(snapshots), [&] { Filler<uint8_t> part(snapshots); });
    expect("Filler of more than 8 bits", Filler<uint16_t>::bytes(snapshots),
           [&] { Filler<uint16_t> part(snapshots); });
    expect("WindowMask", WindowMask::bytes(snapshots, pixels),
           [&] { WindowMask part(snapshots, pixels); });
    expect("PlaneSlots", PlaneSlots::bytes(snapshots, pixels),
           [&] { PlaneSlots part(snapshots, pixels); });
    expect("GridFrames", GridFrames::bytes(grid, snapshots),
           [&] { GridFrames part(grid, snapshots); });

    const GridFrames frames(grid, snapshots);
    expect(
        "PatchFrames", PatchFrames::bytes(grid, count, 1),
        [&] { PatchFrames part(grid, frames, snapshots, &pool); }, kLittle);
    expect("StableFramesRoom", StableFramesRoom::bytes(grid, count),
           [&] { StableFramesRoom part(grid, count); });
    const std::vector<int> reference(grid.cells(), 0);
    expect(
        "patch_distance", patch_distance_bytes(grid, count),
        [&] {
          std::vector<uint16_t> distance(grid.cells() * static_cast<size_t>(snapshots));
          patch_distance(grid, frames, snapshots, reference.data(), &pool, distance.data());
        },
        kLittle);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, PartsMemory,
                         testing::Values(Size{320, 240}, Size{641, 361}, Size{17, 5}, Size{1, 1}),
                         [](const auto& size) {
                           return std::to_string(size.param.width) + "x" +
                                  std::to_string(size.param.height);
                         });

// Frames of the seconds before stay as bits: many of them must cost little.
TEST(MaskBytes, AreOneBitAPixelInWholeRuns) {
  for (const auto& [pixels, bytes] : {std::pair<size_t, size_t>{0, 0}, {1, 8}, {64, 8}, {65, 16}})
    EXPECT_EQ(mask_bytes(pixels), bytes) << pixels;
}

}  // namespace
}  // namespace qdmd::test
