// SPDX-License-Identifier: LGPL-2.1-or-later
// A camera that shows something else is noticed within ten frames, and learning begins anew; other
// light is not taken for it.
#include <cmath>
#include <functional>
#include <random>

#include "core/learn/robust/scene_watch.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 128, kHeight = 96;
constexpr size_t kPixels = size_t{kWidth} * kHeight;

// A street of blocks, other ones for each seed.
std::vector<uint8_t> view(unsigned seed) {
  std::mt19937 rng(seed);
  std::vector<uint8_t> planes(3 * kPixels);
  for (int y = 0; y < kHeight; y += 12)
    for (int x = 0; x < kWidth; x += 16)
      for (size_t c = 0; c < 3; ++c) {
        const auto level = static_cast<uint8_t>(60 + rng() % 120);
        for (int yy = y; yy < y + 12; ++yy)
          std::fill_n(planes.begin() + static_cast<ptrdiff_t>(c * kPixels) + yy * kWidth + x, 16,
                      level);
      }
  return planes;
}

// Frames of what `level_of(frame, sample)` says, with noise, and somebody who walks by.
Clip film(int frames, const std::function<double(int frame, size_t sample)>& level_of) {
  Clip clip(kPixels, static_cast<size_t>(frames));
  std::mt19937 rng(77);
  std::normal_distribution<double> noise(0, 2);
  for (int t = 0; t < frames; ++t)
    for (size_t i = 0; i < 3 * kPixels; ++i) {
      const int x = static_cast<int>(i % kPixels) % kWidth, left = 3 * (t % 50) - 20;
      const double level = x >= left && x < left + 12 ? (i < kPixels ? 220 : 40) : level_of(t, i);
      clip.frames[static_cast<size_t>(t)][i] =
          static_cast<uint8_t>(std::clamp(std::lround(level + noise(rng)), 0l, 255l));
    }
  return clip;
}

struct Seen {
  std::vector<std::vector<uint8_t>> backgrounds;
  std::vector<int> scenes;  // the frames with which another one was noticed
};
Seen run(const Clip& clip, const EngineOptions& options) {
  Seen seen;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  const auto take = [&] {
    while (engine.next()) {
      PackedPicture picture(kWidth, kHeight);
      engine.next()->pop(Output::background, picture.out());
      seen.backgrounds.push_back(picture.planes());
    }
  };
  for (size_t t = 0; t < clip.size(); ++t) {
    PackedPicture picture(kWidth, kHeight);
    picture.fill(clip.frames[t]);
    EXPECT_TRUE(engine.push(picture.in()).ok());
    while (seen.scenes.size() < engine.report().scenes) seen.scenes.push_back(static_cast<int>(t));
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  EXPECT_EQ(seen.backgrounds.size(), clip.size());
  return seen;
}

enum class Pace { batch, batch_beside, live };
std::string name_of(Pace pace) {
  return pace == Pace::live ? "Live" : pace == Pace::batch ? "Batch" : "BatchBeside";
}

class AnotherScene : public testing::TestWithParam<Pace> {
 protected:
  EngineOptions options(int window = 40) const {
    EngineOptions options = robust_of(window);
    options.mode = GetParam() == Pace::live ? Mode::live : Mode::batch;
    // Frames that come fast: a window is solved while others come.
    if (GetParam() == Pace::batch_beside) options.frame_rate = 1e4;
    return options;
  }
  bool live() const { return GetParam() == Pace::live; }
};
INSTANTIATE_TEST_SUITE_P(Modes, AnotherScene,
                         testing::Values(Pace::batch, Pace::batch_beside, Pace::live),
                         [](const auto& pace) { return name_of(pace.param); });

TEST_P(AnotherScene, IsLearntFromItsFirstFramesOn) {
  const auto before = view(1), after = view(2);
  // In the middle of a window, at its beginning, and at its end.
  for (int cut : {100, 120, 118, 81, 60}) {
    SCOPED_TRACE(cut);
    const auto clip = film(200, [&](int t, size_t i) { return (t < cut ? before : after)[i]; });
    const Seen seen = run(clip, options());
    ASSERT_EQ(seen.scenes.size(), 1u);
    EXPECT_LT(seen.scenes[0], cut + 10);
    for (int t = 0; t < 200; ++t) {
      const auto& shown = seen.backgrounds[static_cast<size_t>(t)];
      // Live knows a bit later; of the first frames, somebody who walks by is part.
      if (t >= cut && t < cut + 10) continue;
      EXPECT_LT(mean_error(shown, t < cut ? before : after), live() && t < cut + 35 ? 16 : 2) << t;
    }
  }
}

TEST_P(AnotherScene, IsADarkOneToo) {
  const auto street = view(3);
  // Covered from frame 100 to 180.
  const auto covered = [](int t) { return t >= 100 && t < 180; };
  Clip clip(kPixels, 260);
  std::mt19937 rng(78);
  for (int t = 0; t < 260; ++t)
    for (size_t i = 0; i < 3 * kPixels; ++i)
      clip.frames[static_cast<size_t>(t)][i] =
          static_cast<uint8_t>((covered(t) ? 8 : street[i]) + rng() % 5);
  const Seen seen = run(clip, options());
  ASSERT_EQ(seen.scenes.size(), 2u);
  EXPECT_LT(seen.scenes[0], 110);
  EXPECT_LT(seen.scenes[1], 190);
  for (size_t t = 190; t < 260; ++t) EXPECT_LT(mean_error(seen.backgrounds[t], street), 4) << t;
}

TEST_P(AnotherScene, ComesBackAsItWas) {
  const auto one = view(9), two = view(10);
  // Dusk falls meanwhile.
  const auto clip = film(260, [&](int t, size_t i) {
    return t >= 100 && t < 180 ? two[i] : one[i] * (t < 180 ? 1 : 0.8);
  });
  const Seen seen = run(clip, options());
  EXPECT_EQ(seen.scenes.size(), 2u);
  auto dusk = one;
  for (uint8_t& level : dusk) level = static_cast<uint8_t>(std::lround(0.8 * level));
  // The second frame knows it again; batch sees all of its window.
  for (size_t t = 181; t < 260; ++t) EXPECT_LT(mean_error(seen.backgrounds[t], dusk), 2.5) << t;
}

TEST_P(AnotherScene, IsNotWhoeverStandsBeforeABareWall) {
  const auto wall = [](size_t i) { return 120 + static_cast<double>(i % kWidth) / 8; };
  const auto clip = film(160, [&](int t, size_t i) {
    const int x = static_cast<int>(i % kWidth), y = static_cast<int>(i % kPixels) / kWidth;
    const bool man = t >= 80 && x >= 40 && x < 90 && y >= 10;
    return man ? 40 + 10 * (y % 9) : wall(i);
  });
  EXPECT_TRUE(run(clip, options()).scenes.empty());
}

TEST_P(AnotherScene, IsNoOtherLight) {
  const auto street = view(4);
  const auto colour = [](int t, size_t i) { return t < 100 ? 1 : i < kPixels ? 0.45 : 0.6; };
  const auto lamp = [](size_t i) { return i % kWidth < kWidth / 2 ? 0.5 : 1; };
  const std::function<double(int, size_t)> lights[] = {
      [&](int t, size_t i) { return street[i] * colour(t, i); },
      // Half of the picture, and all at once.
      [&](int t, size_t i) { return street[i] * (t < 100 ? 1 : lamp(i)); },
      // Clipped in an overexposed picture.
      [&](int t, size_t i) { return street[i] * (t % 60 < 30 ? 1 : 1.5); }};
  for (const auto& light : lights) {
    EXPECT_TRUE(run(film(160, light), options()).scenes.empty());
  }
}

TEST_P(AnotherScene, IsTheSameForAnyNumberOfThreads) {
  const auto before = view(5), after = view(6);
  const auto clip = film(150, [&](int t, size_t i) { return (t < 90 ? before : after)[i]; });
  EngineOptions two = options(), three = options();
  two.threads = 2, three.threads = 3;
  EXPECT_EQ(run(clip, two).backgrounds, run(clip, three).backgrounds);
}

// With one thread there is one model.
TEST_P(AnotherScene, WithOneThreadIsLearntToo) {
  const auto before = view(7), after = view(8);
  const auto clip = film(160, [&](int t, size_t i) { return (t < 100 ? before : after)[i]; });
  EngineOptions one = options();
  one.threads = 1;
  const Seen seen = run(clip, one);
  EXPECT_EQ(seen.scenes.size(), 1u);
  EXPECT_LT(mean_error(seen.backgrounds.back(), after), 2);
}

TEST(SceneWatch, OfTinyPicturesSaysNothing) {
  const Grid grid = grid_of(1, 1);
  GridFrames frames(grid, 2);
  frames.plane(1, 0)[0] = 200;
  const float* const a[3] = {frames.plane(0, 0), frames.plane(0, 1), frames.plane(0, 2)};
  const float* const b[3] = {frames.plane(1, 0), frames.plane(1, 1), frames.plane(1, 2)};
  SceneWatch watch(grid);
  for (int t = 0; t < 20; ++t) EXPECT_EQ(watch.follow(a, b), SceneSeen::same);
}

// A camera that comes from a bare wall to a street: nothing of the background can be missed, and
// all of the frame is new.
TEST(SceneWatch, ABareWallIsLeftWhereEdgesComeNearlyEverywhere) {
  const Grid grid = grid_of(32, 32);
  constexpr int kTile = 8;
  // So many tiles of 16 have edges; their places do not matter.
  const auto noticed_after = [&](int tiles) {
    std::mt19937 rng(7);
    GridFrames frames(grid, 2);
    for (int c = 0; c < 3; ++c)
      for (size_t cell = 0; cell < grid.cells(); ++cell) {
        const size_t row = cell / 32, col = cell % 32;
        const size_t tile = row / kTile * 4 + col / kTile;
        frames.plane(0, c)[cell] = 100;
        const bool inside = row % kTile < kTile - 2 && col % kTile < kTile - 2;
        const bool edged = inside && tile < static_cast<size_t>(tiles);
        frames.plane(1, c)[cell] = edged ? static_cast<float>(40 + rng() % 160) : 100;
      }
    const float* wall[3];
    const float* street[3];
    for (int c = 0; c < 3; ++c) wall[c] = frames.plane(0, c), street[c] = frames.plane(1, c);
    SceneWatch watch(grid);
    for (int t = 1; t <= 2 * SceneWatch::kFrames; ++t)
      if (watch.follow(street, wall) == SceneSeen::another) return t;
    return 0;
  };
  EXPECT_EQ(noticed_after(16), SceneWatch::kFrames);
  EXPECT_EQ(noticed_after(14), SceneWatch::kFrames);
  // Somebody stands before the wall.
  EXPECT_EQ(noticed_after(13), 0);
  EXPECT_EQ(noticed_after(4), 0);
}

}  // namespace
}  // namespace qdmd::test
