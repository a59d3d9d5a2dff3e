// SPDX-License-Identifier: LGPL-2.1-or-later
// Batch: who stands through a window and leaves is foreground in the frames of it that still wait.
#include "core/learn/robust/standing_looks.h"

#include <array>
#include <climits>
#include <cmath>
#include <functional>
#include <random>

#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 96, kHeight = 64, kWindow = 50, kFrames = 150;
constexpr size_t kPixels = size_t{kWidth} * kHeight;

bool in_bag(int x, int y) { return x >= 40 && x < 64 && y >= 20 && y < 44; }
int floor_level(size_t channel, int x, int y) {
  return 90 + 10 * static_cast<int>(channel) + x / 4 + y / 2;
}

// A bag lies there in the frames that `lies` says, in the light that `light` says. Somebody walks
// by. Cells are pixels here: noise is that of their means in larger pictures.
Clip bag(
    const std::function<bool(int frame)>& lies,
    const std::function<double(int frame)>& light = [](int) { return 1.0; }) {
  Clip clip(kPixels, kFrames);
  std::mt19937 rng(417);
  std::normal_distribution<double> noise(0, 1);
  for (int t = 0; t < kFrames; ++t) {
    const int left = 2 * (t % 80) - 20;
    for (size_t i = 0; i < 3 * kPixels; ++i) {
      const size_t channel = i / kPixels;
      const int x = static_cast<int>(i % kPixels) % kWidth,
                y = static_cast<int>(i % kPixels) / kWidth;
      int level = floor_level(channel, x, y);
      if (lies(t) && in_bag(x, y)) level = 30 + (x + y) % 7;
      if (x >= left && x < left + 8 && y < 18) level = channel == 0 ? 230 : 60;
      clip.frames[static_cast<size_t>(t)][i] =
          static_cast<uint8_t>(std::clamp(std::lround(light(t) * level + noise(rng)), 0l, 255l));
    }
  }
  return clip;
}

// What was seen in each frame.
struct Left {
  std::vector<double> white;    // the share of the bag's middle that is foreground
  std::vector<double> red;      // the background there, mean
  std::vector<int> foreground;  // pixels of the whole mask
  int delay = 0;                // frames that wait
};

class WaitingFrames : public testing::TestWithParam<bool> {
 protected:
  EngineOptions options() const {
    EngineOptions options = robust_of(kWindow);
    // Frames that come fast: a window is solved while others come.
    if (GetParam()) options.frame_rate = 1e4;
    return options;
  }
  static Left run(const Clip& clip, const EngineOptions& options, int64_t absorb_frames = 0,
                  int freeze_at = INT_MAX) {
    Left left;
    Engine engine;
    EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
    left.delay = engine.report().delay;
    Wishes wishes = first_wishes(options);
    wishes.absorb_frames = absorb_frames;
    const auto take = [&] {
      while (engine.next()) {
        PackedPicture mask(kWidth, kHeight), background(kWidth, kHeight);
        engine.next()->write(Output::mask, {}, mask.out());
        engine.next()->pop(Output::background, background.out());
        double hits = 0, sum = 0, pixels = 0;
        for (int y = 22; y < 42; ++y)
          for (int x = 42; x < 62; ++x) {
            const auto at = static_cast<size_t>(y * kWidth + x);
            hits += mask.at(0, at) > 0;
            sum += background.at(0, at);
            ++pixels;
          }
        int foreground = 0;
        for (size_t i = 0; i < kPixels; ++i) foreground += mask.at(0, i) > 0;
        left.foreground.push_back(foreground);
        left.white.push_back(hits / pixels);
        left.red.push_back(sum / pixels);
      }
    };
    for (size_t t = 0; t < clip.size(); ++t) {
      PackedPicture picture(kWidth, kHeight);
      picture.fill(clip.frames[t]);
      wishes.freeze = static_cast<int>(t) >= freeze_at;
      EXPECT_TRUE(engine.push(picture.in(), &wishes).ok());
      take();
    }
    EXPECT_TRUE(engine.drain().ok());
    take();
    EXPECT_EQ(left.white.size(), size_t{kFrames});
    return left;
  }
};
INSTANTIATE_TEST_SUITE_P(Beside, WaitingFrames, testing::Values(false, true),
                         [](const auto& beside) { return beside.param ? "Beside" : "AtOnce"; });

// The floor in the middle of the bag.
constexpr double kFloor = 90 + 51.5 / 4 + 31.5 / 2, kBag = 33;

TEST_P(WaitingFrames, WhatLeavesAfterTheFirstWindowWasForeground) {
  constexpr int kLeaves = 60;
  const Left left = run(bag([](int t) { return t < kLeaves; }), options());
  // The bag's place is known when it was seen for StandingLooks::kSteady frames; window - 1 frames
  // wait.
  const int known = kLeaves + StandingLooks::kSteady - (kWindow - 1) + 1;
  for (int t = known; t < kFrames; ++t) {
    EXPECT_NEAR(left.red[static_cast<size_t>(t)], kFloor, 3) << t;
    if (t < kLeaves)
      EXPECT_GT(left.white[static_cast<size_t>(t)], 0.9) << t;
    else
      EXPECT_LT(left.white[static_cast<size_t>(t)], 0.1) << t;
  }
}

// The bag's place is seen in other light than the frames that wait have.
TEST_P(WaitingFrames, KeepsTheLightOfFrames) {
  constexpr int kLeaves = 65, kDusk = 58;
  const Left left = run(
      bag([](int t) { return t < kLeaves; }, [](int t) { return t < kDusk ? 1 : 0.7; }), options());
  for (int t = kLeaves + StandingLooks::kSteady - (kWindow - 1) + 1; t < kWindow; ++t) {
    EXPECT_NEAR(left.red[static_cast<size_t>(t)], kFloor, 3) << t;
    EXPECT_GT(left.white[static_cast<size_t>(t)], 0.9) << t;
  }
}

TEST_P(WaitingFrames, WhatStaysIsBackground) {
  // In other light from frame 60 on, too.
  for (double light : {1.0, 0.7}) {
    const Left left =
        run(bag([](int) { return true; }, [&](int t) { return t < 60 ? 1 : light; }), options());
    for (int t = 0; t < kFrames; ++t) {
      EXPECT_LT(left.white[static_cast<size_t>(t)], 0.1) << t << ", light " << light;
      EXPECT_NEAR(left.red[static_cast<size_t>(t)], (t < 60 ? 1 : light) * kBag, 4) << t;
    }
  }
}

TEST_P(WaitingFrames, WhatComesLaterIsForegroundAndStaysIt) {
  const Left left = run(bag([](int t) { return t >= 60; }), options());
  for (int t = 0; t < kFrames; ++t) {
    EXPECT_NEAR(left.red[static_cast<size_t>(t)], kFloor, 3) << t;
    if (t < 60)
      EXPECT_LT(left.white[static_cast<size_t>(t)], 0.1) << t;
    else
      EXPECT_GT(left.white[static_cast<size_t>(t)], 0.9) << t;
  }
}

TEST_P(WaitingFrames, LaterWindowsAreRevisedToo) {
  constexpr int kLeaves = 110;
  const Left left = run(bag([](int t) { return t < kLeaves; }), options());
  // Frames that had left before that was known have the bag for background.
  const int known = kLeaves + StandingLooks::kSteady, waits = known - left.delay;
  ASSERT_GT(waits, kWindow);
  for (int t = 0; t < waits - 1; ++t) EXPECT_LT(left.white[static_cast<size_t>(t)], 0.1) << t;
  for (int t = waits + 15; t < kLeaves; ++t)
    EXPECT_GT(left.white[static_cast<size_t>(t)], 0.9) << t;
}

// People who say that what stands for 40 frames is background mean this, too.
TEST_P(WaitingFrames, WhatWasAbsorbedIsNoForeground) {
  const Left left = run(bag([](int t) { return t < 60; }), options(), 40);
  for (int t = 0; t < kWindow; ++t) EXPECT_LT(left.white[static_cast<size_t>(t)], 0.1) << t;
}

// People who hold a background want the one that there is.
TEST_P(WaitingFrames, WhatIsHeldStaysAsItIs) {
  for (int freeze_at : {0, 45, 55}) {
    const Left left = run(bag([](int t) { return t < 60; }), options(), 0, freeze_at);
    // A window that was begun is solved.
    for (int t = 0; t < (freeze_at < kWindow ? kFrames : kWindow); ++t)
      EXPECT_NEAR(left.red[static_cast<size_t>(t)], kBag, 4) << t << ", held from " << freeze_at;
  }
}

// The place was seen, and somebody is in front of it when the background comes into use.
TEST_P(WaitingFrames, TakesNoPasserByForWhatWasHidden) {
  EngineOptions options = this->options();
  options.window_size = 100;
  for (int until : {120, 124, 128}) {
    Clip clip = bag([](int t) { return t < 100; });
    for (int t = 115; t < until; ++t)
      for (size_t i = 0; i < kPixels; ++i)
        if (in_bag(static_cast<int>(i) % kWidth, static_cast<int>(i) / kWidth))
          clip.frames[static_cast<size_t>(t)][i] = 230;
    const Left left = run(clip, options);
    for (int t = until + 10 - 99; t < 100; ++t)
      EXPECT_NEAR(left.red[static_cast<size_t>(t)], kFloor, 3) << t << ", until " << until;
  }
}

// Most of what differs then is no place that somebody has left.
TEST_P(WaitingFrames, ACameraThatWasMovedChangesNoFramesBefore) {
  for (unsigned seed : {6u, 7u}) {
    constexpr size_t kShift = 9;
    Clip clip(kPixels, kFrames);
    std::mt19937 rng(seed);
    std::normal_distribution<double> noise(0, 1);
    std::vector<int> block(3 * 20 * 20);
    for (int& level : block) level = 60 + static_cast<int>(rng() % 120);
    for (int t = 0; t < kFrames; ++t)
      for (size_t i = 0; i < 3 * kPixels; ++i) {
        const auto x = i % kWidth + (t < 60 ? 0 : kShift), y = i % kPixels / kWidth;
        const double level = block[i / kPixels * 400 + y / 12 * 20 + x / 16];
        clip.frames[static_cast<size_t>(t)][i] =
            static_cast<uint8_t>(std::lround(level + noise(rng)));
      }
    const Left left = run(clip, options());
    for (int t = 0; t < kWindow; ++t)
      EXPECT_LT(left.foreground[static_cast<size_t>(t)], 20) << t << ", seed " << seed;
  }
}

TEST_P(WaitingFrames, IsTheSameForAnyNumberOfThreads) {
  EngineOptions one = options(), three = options();
  one.threads = 1, three.threads = 3;
  const Clip clip = bag([](int t) { return t < 60; });
  const Left a = run(clip, one), b = run(clip, three);
  EXPECT_EQ(a.white, b.white);
  EXPECT_EQ(a.red, b.red);
}

}  // namespace
}  // namespace qdmd::test
