// SPDX-License-Identifier: LGPL-2.1-or-later
// What comes and stands still is foreground for its time, and background from then on; what leaves
// is known at once.
#include <cmath>
#include <random>

#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr size_t kPixels = size_t{kWidth} * kHeight;
constexpr int kFrom = 60, kUntil = 300, kFrames = 360;

uint8_t floor_level(size_t channel, int x, int y) {
  return static_cast<uint8_t>(90 + 10 * static_cast<int>(channel) + x / 4 + y / 2);
}
bool in_bag(int x, int y) { return x >= 40 && x < 64 && y >= 20 && y < 44; }

// A bag lies there from frame kFrom to frame kUntil. Somebody walks by.
Clip bag(double light = 1) {
  Clip clip(kPixels, kFrames);
  std::mt19937 rng(911);
  std::normal_distribution<double> noise(0, 2);
  for (int t = 0; t < kFrames; ++t) {
    const int left = 2 * (t % 80) - 20;
    const double gain = t % 2 ? light : 1;
    for (size_t i = 0; i < 3 * kPixels; ++i) {
      const size_t channel = i / kPixels;
      const int x = static_cast<int>(i % kPixels) % kWidth,
                y = static_cast<int>(i % kPixels) / kWidth;
      int level = floor_level(channel, x, y);
      if (t >= kFrom && t < kUntil && in_bag(x, y)) level = 30 + (x + y) % 7;
      if (x >= left && x < left + 8 && y < 50) level = channel == 0 ? 230 : 60;
      clip.frames[static_cast<size_t>(t)][i] =
          static_cast<uint8_t>(std::clamp(std::lround(gain * level + noise(rng)), 0l, 255l));
    }
  }
  return clip;
}

// The share of the bag's middle that is white, of frames without a passer-by there; -1 otherwise.
std::vector<double> white_of(const Clip& clip, const EngineOptions& options, int64_t frames) {
  std::vector<double> white;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  Wishes wishes = first_wishes(options);
  wishes.absorb_frames = frames;
  const auto take = [&] {
    while (engine.next()) {
      PackedPicture picture(kWidth, kHeight);
      engine.next()->pop(Output::mask, picture.out());
      const auto left = 2 * static_cast<int>(white.size() % 80) - 20;
      int hits = 0, pixels = 0;
      for (int y = 22; y < 42; ++y)
        for (int x = 42; x < 62; ++x) {
          hits += picture.at(0, static_cast<size_t>(y * kWidth + x)) > 0;
          ++pixels;
        }
      const bool passes = left + 8 > 36 && left < 68;
      white.push_back(passes ? -1 : static_cast<double>(hits) / pixels);
    }
  };
  for (const auto& frame : clip.frames) {
    PackedPicture picture(kWidth, kHeight);
    picture.fill(frame);
    EXPECT_TRUE(engine.push(picture.in(), &wishes).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  return white;
}

enum class Pace { batch, batch_beside, live };
std::string name_of(Pace pace) {
  return pace == Pace::live ? "Live" : pace == Pace::batch ? "Batch" : "BatchBeside";
}

class Absorb : public testing::TestWithParam<Pace> {
 protected:
  EngineOptions options() const {
    EngineOptions options = robust_of(50);
    options.mode = GetParam() == Pace::live ? Mode::live : Mode::batch;
    // Frames that come fast: a window is solved while others come.
    if (GetParam() == Pace::batch_beside) options.frame_rate = 1e4;
    return options;
  }
};
INSTANTIATE_TEST_SUITE_P(Modes, Absorb,
                         testing::Values(Pace::batch, Pace::batch_beside, Pace::live),
                         [](const auto& pace) { return name_of(pace.param); });

TEST_P(Absorb, WhatStandsIsForegroundForItsTimeAndThenBackground) {
  for (double light : {1.0, 0.8}) {
    const auto white = white_of(bag(light), options(), 120);
    ASSERT_EQ(white.size(), size_t{kFrames});
    for (int t = 0; t < kFrames; ++t) {
      const double share = white[static_cast<size_t>(t)];
      if (share < 0) continue;
      // Somebody may stand before it when its time is over.
      constexpr int kSlack = 25;
      if (t >= kFrom && t < kFrom + 115) {
        EXPECT_GT(share, 0.9) << t << ", light " << light;
      } else if (t < kFrom || (t >= kFrom + 120 + kSlack && t < kUntil) || t >= kUntil + 20) {
        EXPECT_LT(share, 0.1) << t << ", light " << light;
      }
    }
  }
}

TEST_P(Absorb, NeverIsNever) {
  const auto white = white_of(bag(), options(), 0);
  for (int t = 0; t < kFrames; ++t) {
    const double share = white[static_cast<size_t>(t)];
    if (share < 0) continue;
    if (t >= kFrom && t < kUntil) {
      EXPECT_GT(share, 0.9) << t;
    } else {
      EXPECT_LT(share, 0.1) << t;
    }
  }
}

TEST_P(Absorb, IsTheSameForAnyNumberOfThreads) {
  EngineOptions one = options(), three = options();
  one.threads = 1, three.threads = 3;
  EXPECT_EQ(white_of(bag(), one, 100), white_of(bag(), three, 100));
}

// Frames of 10 bits, all channels the same: every level is half a level off those of 8 bits. What
// takes a place in the background, and what comes back to it, has the depth of the frames.
TEST_P(Absorb, KeepsTheDepthOfFrames) {
  constexpr int kUnit = 4;
  EngineOptions options = this->options();
  options.depth = 10;
  Engine engine;
  ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  Wishes wishes = first_wishes(options);
  wishes.absorb_frames = 120;
  std::mt19937 rng(912);
  std::normal_distribution<double> noise(0, 0.4);
  std::vector<uint8_t> bytes(2 * kPixels);
  BasicImageView<uint8_t> view;
  view.width = kWidth, view.height = kHeight;
  view.bits = {10, 0};
  view.pixel_stride = 2, view.row_stride = 2 * kWidth;
  for (auto& channel : view.channel) channel = bytes.data();
  BasicImageView<const uint8_t> in;
  in.width = view.width, in.height = view.height, in.bits = view.bits;
  in.pixel_stride = view.pixel_stride, in.row_stride = view.row_stride;
  for (auto& channel : in.channel) channel = bytes.data();

  const auto truth = [](bool with_bag, int x, int y) {
    return 0.5 + (with_bag && in_bag(x, y) ? 30 + (x + y) % 7 : floor_level(0, x, y));
  };
  int seen = 0, compared = 0;
  const auto take = [&] {
    for (; engine.next(); ++seen) {
      engine.next()->pop(Output::background, view);
      constexpr int kSlack = 25;
      const bool absorbed = seen >= kFrom + 120 + kSlack && seen < kUntil;
      const bool uncovered = seen >= kUntil + 20;
      if (!absorbed && !uncovered) continue;
      double error = 0;
      for (int y = 22; y < 42; ++y)
        for (int x = 42; x < 62; ++x) {
          const uint8_t* at = bytes.data() + 2 * (y * kWidth + x);
          const double level = static_cast<double>(at[0] | at[1] << 8) / kUnit;
          error += std::abs(level - truth(absorbed, x, y)) / 400;
        }
      // A median of a few frames; a level of 8 bits would be off by 0.5.
      EXPECT_LT(error, 0.35) << seen;
      ++compared;
    }
  };
  for (int t = 0; t < kFrames; ++t) {
    const int left = 2 * (t % 80) - 20;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        double level = truth(t >= kFrom && t < kUntil, x, y);
        if (x >= left && x < left + 8 && y < 50) level = 230;
        const auto sample = static_cast<int>(std::lround(kUnit * (level + noise(rng))));
        bytes[static_cast<size_t>(2 * (y * kWidth + x))] = static_cast<uint8_t>(sample & 255);
        bytes[static_cast<size_t>(2 * (y * kWidth + x) + 1)] = static_cast<uint8_t>(sample >> 8);
      }
    ASSERT_TRUE(engine.push(in, &wishes).ok());
    take();
  }
  ASSERT_TRUE(engine.drain().ok());
  take();
  EXPECT_EQ(seen, kFrames);
  EXPECT_GT(compared, 100);
}

}  // namespace
}  // namespace qdmd::test
