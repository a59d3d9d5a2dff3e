// SPDX-License-Identifier: LGPL-2.1-or-later
// What robust Q-DMD knows beyond its window: frames that have left it, the looks of cells, what was
// uncovered, and light that is followed.
#include <cmath>
#include <random>

#include "core/learn/robust/frame_memory.h"
#include "core/learn/robust/light.h"
#include "core/learn/robust/standing_looks.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

// ---- Frames that are kept ----

struct Kept {
  explicit Kept(int capacity)
      : grid(grid_of(2, 3)), memory(capacity, {2, 3}, grid), window(1, 6), cells(grid, 1) {
    window.append();
  }
  void keep(int64_t number, int64_t horizon = 1 << 30) {
    for (int c = 0; c < kChannels; ++c) {
      std::fill_n(window.plane(0, c), 6, static_cast<uint8_t>(number % 200 + c));
      std::fill_n(cells.plane(0, c), 6, static_cast<float>(number));
    }
    memory.keep(number, SnapshotRange(window), 0, cells, horizon, &pool);
  }

  Pool pool{2};
  Grid grid;
  FrameMemory memory;
  Window window;
  GridFrames cells;
};

TEST(FrameMemory, KeepsWhatItWasGiven) {
  Kept all(20);
  EXPECT_EQ(all.memory.newest(), -1);
  for (int64_t number = 0; number < 1000; number += 3) {
    all.keep(number);
    ASSERT_EQ(all.memory.newest(), number);
    ASSERT_LE(all.memory.size(), 20);
    for (int i = 0; i < all.memory.size(); ++i) {
      const int64_t kept = all.memory.number(i);
      if (i > 0) {
        ASSERT_LT(all.memory.number(i - 1), kept);
      }
      for (int c = 0; c < kChannels; ++c) {
        ASSERT_EQ(all.memory.plane(i, c)[5], kept % 200 + c);
        ASSERT_EQ(all.memory.cells().plane(all.memory.slot(i), c)[5], static_cast<float>(kept));
      }
    }
  }
}

TEST(FrameMemory, TheOlderTheSparser) {
  Kept all(30);
  for (int64_t number = 0; number < 5000; ++number) all.keep(number);
  // Gaps between frames grow with age: no gap is more than a third of the time since then.
  int64_t nearest = 5000, widest = 0;
  for (int i = 1; i < all.memory.size(); ++i) {
    const int64_t gap = all.memory.number(i) - all.memory.number(i - 1);
    EXPECT_LE(3 * gap, 2 * (5000 - all.memory.number(i - 1))) << i;
    nearest = std::min(nearest, gap);
    widest = std::max(widest, gap);
  }
  EXPECT_EQ(nearest, 1);
  EXPECT_GT(widest, 300);
  EXPECT_EQ(all.memory.number(0), 0) << "the oldest is the only one of its time";
}

TEST(FrameMemory, ForgetsWhatIsTooOld) {
  Kept all(30);
  for (int64_t number = 0; number < 1000; number += 4) all.keep(number, 200);
  EXPECT_GE(all.memory.number(0), 796);
  EXPECT_EQ(all.memory.older_than(0), 0);
  EXPECT_EQ(all.memory.older_than(997), all.memory.size());
  EXPECT_EQ(all.memory.older_than(all.memory.number(7)), 7);
  all.memory.forget();
  EXPECT_EQ(all.memory.size(), 0);
  all.keep(5);
  EXPECT_EQ(all.memory.number(0), 5);
}

TEST(FrameMemory, OfNoFramesKeepsNone) {
  Kept all(0);
  all.keep(3);
  EXPECT_EQ(all.memory.size(), 0);
}

// ---- Looks of cells ----

// A floor of one level with a box of another.
struct Floor {
  Floor() : grid(grid_of(20, 30)), picture(grid, 1) { fill(100); }
  void fill(float level) {
    for (int c = 0; c < kChannels; ++c) std::fill_n(picture.plane(0, c), grid.cells(), level);
  }
  void box(float level) {
    for (int c = 0; c < kChannels; ++c)
      for (int y = 5; y < 12; ++y) std::fill_n(picture.plane(0, c) + 30 * y + 8, 5, level);
  }
  std::array<const float *, 3> planes() const {
    return {picture.plane(0, 0), picture.plane(0, 1), picture.plane(0, 2)};
  }
  Grid grid;
  GridFrames picture;
};

TEST(StandingLooks, WhatLeftIsNoticedAndWhatCameIsNot) {
  for (bool leaves : {true, false})
    for (const Gain &light : {kSameLight, Gain{0.7f, 0.8f, 0.9f}}) {
      Floor background, frame;
      (leaves ? background : frame).box(180);
      // What is seen has this light.
      for (int c = 0; c < kChannels; ++c)
        for (size_t cell = 0; cell < frame.grid.cells(); ++cell)
          frame.picture.plane(0, c)[cell] *= light[static_cast<size_t>(c)];
      StandingLooks looks(frame.grid);
      for (int t = 1; t < 30; ++t) {
        looks.follow(frame.planes().data(), light, t);
        const auto found = looks.uncovered(background.planes().data());
        EXPECT_EQ(found.size(), leaves && t >= StandingLooks::kSteady ? 35u : 0u) << t;
        for (int cell : found) {
          EXPECT_NEAR(looks.level(cell, 1), 100, 0.1);
        }
      }
      looks.forget();
      EXPECT_TRUE(looks.uncovered(background.planes().data()).empty());
    }
}

TEST(StandingLooks, WhoPassesIsNoLook) {
  Floor background, empty, passing;
  background.box(180);
  passing.box(40);
  StandingLooks looks(empty.grid);
  for (int t = 0; t < 12; ++t) looks.follow(empty.planes().data(), kSameLight, t);
  ASSERT_FALSE(looks.uncovered(background.planes().data()).empty());
  // Fewer frames than a look needs.
  for (int t = 1; t < StandingLooks::kSteady; ++t)
    looks.follow(passing.planes().data(), kSameLight, t);
  EXPECT_TRUE(looks.uncovered(background.planes().data()).empty()) << "somebody is before it";
  looks.follow(empty.planes().data(), kSameLight, 30);
  const auto again = looks.uncovered(background.planes().data());
  EXPECT_EQ(again.size(), 35u);
  for (int cell : again) EXPECT_NEAR(looks.level(cell, 0), 100, 0.1);
}

TEST(StandingLooks, WhatStandsIsKnownAfterItsTimeWhoeverPasses) {
  Floor empty, bag, passing;
  bag.box(180);
  passing.box(40);
  StandingLooks looks(empty.grid);
  const auto planes = empty.planes();
  for (int t = 0; t < 200; ++t) {
    // From frame 40 on; somebody stands before it for a while.
    const Floor &frame = t < 40 ? empty : t >= 70 && t < 90 ? passing : bag;
    looks.follow(frame.planes().data(), kSameLight, t);
    const auto &stood = looks.stood(planes.data(), 100);
    ASSERT_EQ(!stood.empty(), t >= 140) << t;
    if (stood.empty()) continue;
    // With the cells next to it.
    EXPECT_EQ(stood.size(), 9u * 7u);
    EXPECT_EQ(looks.since(30 * 6 + 9), 40);
  }
  // What has gone is no longer there, and what comes again has to wait anew.
  for (int t = 200; t < 600; ++t) {
    looks.follow((t < 500 ? empty : bag).planes().data(), kSameLight, t);
    ASSERT_TRUE(looks.stood(planes.data(), 100).empty()) << t;
  }
}

TEST(StandingLooks, OfTinyPicturesSayNothing) {
  const Grid grid = grid_of(1, 1);
  GridFrames one(grid, 1), other(grid, 1);
  for (int c = 0; c < kChannels; ++c) other.plane(0, c)[0] = 200;
  const float *const a[3] = {one.plane(0, 0), one.plane(0, 1), one.plane(0, 2)},
                     *const b[3] = {other.plane(0, 0), other.plane(0, 1), other.plane(0, 2)};
  StandingLooks looks(grid);
  for (int t = 0; t < 20; ++t) looks.follow(a, kSameLight, t);
  EXPECT_TRUE(looks.uncovered(b).empty());
}

// ---- Live: what was uncovered ----

constexpr int kWidth = 96, kHeight = 64;

std::vector<uint8_t> street() {
  std::vector<uint8_t> planes(3 * kWidth * kHeight);
  for (size_t i = 0; i < planes.size(); ++i) {
    const auto p = static_cast<int>(i % (kWidth * kHeight));
    planes[i] = static_cast<uint8_t>(100 + p % kWidth / 4 + p / kWidth / 2);
  }
  return planes;
}

// A man stands through the first 150 frames.
Clip standing_man() {
  Clip clip(kWidth * kHeight, 200);
  std::mt19937 rng(811);
  std::normal_distribution<double> noise(0, 2);
  for (size_t t = 0; t < clip.size(); ++t) {
    clip.frames[t] = street();
    for (size_t i = 0; i < clip.frames[t].size(); ++i) {
      const int p = static_cast<int>(i % clip.pixels), x = p % kWidth, y = p / kWidth;
      if (t < 150 && x >= 40 && x < 60 && y >= 15 && y < 55)
        clip.frames[t][i] = static_cast<uint8_t>(i < clip.pixels ? 40 : 200);
      clip.frames[t][i] =
          static_cast<uint8_t>(std::clamp(std::lround(clip.frames[t][i] + noise(rng)), 0l, 255l));
    }
  }
  return clip;
}

TEST(RobustLive, WhoLeavesIsOutOfTheBackgroundAfter15Frames) {
  EngineOptions options = robust_of(100);
  options.mode = Mode::live;
  const auto pictures = run_engine(standing_man(), kWidth, kHeight, options);
  const auto empty = street();
  EXPECT_GT(mean_error(pictures[149], empty), 8) << "nobody knows what is behind him";
  for (size_t t = 165; t < 200; ++t) EXPECT_LT(mean_error(pictures[t], empty), 1.5) << t;
}

TEST(RobustLive, IsTheSameForAnyNumberOfThreads) {
  EngineOptions options = robust_of(60);
  options.mode = Mode::live;
  const auto one = run_engine(standing_man(), kWidth, kHeight, options);
  options.threads = 3;
  EXPECT_EQ(run_engine(standing_man(), kWidth, kHeight, options), one);
}

// ---- Live: solves that are left out ----

// Frames with which a new background came into use: hops have ten.
std::vector<int> solved_frames(const Clip &clip) {
  EngineOptions options = robust_of(40);
  options.mode = Mode::live;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  std::vector<int> frames;
  uint64_t solves = 0;
  for (size_t t = 0; t < clip.size(); ++t) {
    PackedPicture picture(kWidth, kHeight);
    picture.fill(clip.frames[t]);
    EXPECT_TRUE(engine.push(picture.in()).ok());
    engine.next()->pop(Output::background, picture.out());
    if (engine.report().solves > solves) frames.push_back(static_cast<int>(t));
    solves = engine.report().solves;
  }
  return frames;
}

// A street, and from `comes` on somebody who stands there; no disturbance is so small.
Clip street_with(size_t comes, size_t count) {
  Clip clip(kWidth * kHeight, count);
  std::mt19937 rng(814);
  std::normal_distribution<double> noise(0, 2);
  for (size_t t = 0; t < count; ++t) {
    clip.frames[t] = street();
    for (size_t i = 0; i < clip.frames[t].size(); ++i) {
      const int p = static_cast<int>(i % clip.pixels), x = p % kWidth, y = p / kWidth;
      if (t >= comes && x >= 40 && x < 54 && y >= 15 && y < 55)
        clip.frames[t][i] = static_cast<uint8_t>(i < clip.pixels ? 40 : 200);
      clip.frames[t][i] =
          static_cast<uint8_t>(std::clamp(std::lround(clip.frames[t][i] + noise(rng)), 0l, 255l));
    }
  }
  return clip;
}

int count_between(const std::vector<int> &frames, int first, int end) {
  return static_cast<int>(
      std::count_if(frames.begin(), frames.end(), [&](int t) { return t >= first && t < end; }));
}

TEST(RobustLive, ABackgroundThatHasSettledIsSolvedOnceAWindow) {
  const auto solved = solved_frames(street_with(400, 400));
  EXPECT_EQ(count_between(solved, 200, 400), 5) << "one of four hops";
}

TEST(RobustLive, WhatStopsIsLookedAtInTheNextHop) {
  // Frame 240 and on: with any hop, solves of a still street would be 40 frames apart.
  const auto solved = solved_frames(street_with(241, 300));
  EXPECT_EQ(count_between(solved, 161, 241), 2);
  // Ten frames until it is a look, a hop until it is solved, and one for the solve.
  EXPECT_GE(count_between(solved, 251, 275), 1);
  EXPECT_GE(count_between(solved, 251, 300), 2);
}

// ---- A look of long ago ----

// The place is empty in the first window; then somebody stands there for two windows.
TEST(RobustBatch, WhatWasSeenOnceIsKnownTwoWindowsLater) {
  Clip clip = standing_man();
  std::rotate(clip.frames.begin(), clip.frames.begin() + 150, clip.frames.end());
  const auto pictures = run_engine(clip, kWidth, kHeight, robust_of(50));
  ASSERT_EQ(pictures.size(), 200u);
  for (size_t t = 0; t < 200; ++t) EXPECT_LT(mean_error(pictures[t], street()), 1.5) << t;
}

// ---- Light that is followed ----

// People cover other thirds of the picture while the camera gets used to them: frames of the
// beginning and of the end have little of the background in common.
TEST(LightOf, IsFollowedFromFrameToFrame) {
  const Grid grid = grid_of(20, 30);
  constexpr int kFrames = 40;
  std::mt19937 rng(812);
  std::uniform_real_distribution<float> level(120, 200);
  GridFrames background(grid, 1), frames(grid, kFrames);
  for (int c = 0; c < kChannels; ++c)
    for (size_t cell = 0; cell < grid.cells(); ++cell) background.plane(0, c)[cell] = level(rng);
  std::vector<float> truth;
  for (int t = 0; t < kFrames; ++t) {
    truth.push_back(t < 10 ? 0.85f : std::min(1.0f, 0.85f + 0.015f * static_cast<float>(t - 9)));
    // Two people, each a third of the picture wide, walk to the other side.
    const int left = t / 4, right = 20 - t / 4;
    for (int c = 0; c < kChannels; ++c)
      for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 30; ++x) {
          const size_t cell = static_cast<size_t>(30 * y + x);
          float seen = background.plane(0, c)[cell];
          if (x >= left && x < left + 10) seen = 60 + 7.0f * static_cast<float>((x - left + y) % 5);
          if (x >= right && x < right + 10)
            seen = 90 + 9.0f * static_cast<float>((x - right + 2 * y) % 4);
          frames.plane(t, c)[cell] = seen * truth.back();
        }
  }
  const auto found = light_of(frames, kFrames).gains;
  for (size_t t = 0; t < kFrames; ++t)
    EXPECT_NEAR(found[t][1] / found[kFrames - 1][1], truth[t] / truth[kFrames - 1], 0.03) << t;
}

TEST(LightBetween, IsThatOfItsNeighboursOrOneOfThem) {
  const Grid grid = grid_of(6, 6);
  GridFrames background(grid, 1), frame(grid, 1);
  for (int c = 0; c < kChannels; ++c) {
    std::fill_n(background.plane(0, c), grid.cells(), 150.0f);
    std::fill_n(frame.plane(0, c), grid.cells(), 75.0f);
  }
  const Gain dark = {0.5f, 0.5f, 0.5f}, nearly = {0.51f, 0.51f, 0.51f};
  EXPECT_EQ(light_between(frame, 0, background, 0, dark, kSameLight), dark);
  EXPECT_EQ(light_between(frame, 0, background, 0, kSameLight, dark), dark);
  EXPECT_NEAR(light_between(frame, 0, background, 0, dark, nearly)[0], 0.505, 1e-4);
  EXPECT_EQ(light_between(frame, 0, background, 0, kSameLight, kSameLight), kSameLight);
}

}  // namespace
}  // namespace qdmd::test
