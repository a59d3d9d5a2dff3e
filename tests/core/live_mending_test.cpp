// SPDX-License-Identifier: LGPL-2.1-or-later
// What is uncovered while solves that know nothing of it are still to come into use.
#include <array>
#include <functional>
#include <random>

#include "core/learn/robust/standing_looks.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

// A solve of frames of this size comes into use so many frames later, in a window of 100.
constexpr int kWidth = 576, kHeight = 384, kPiece = 14;
constexpr size_t kPixels = size_t{kWidth} * kHeight;
// The solve with frame kSolve sees the floor in one frame only.
constexpr int kSolve = 113, kLeaves = kSolve - 1, kFrames = 150;
constexpr int kFloor = 120, kBag = 33, kPasser = 230;

bool in_bag(int x, int y) { return x >= 240 && x < 384 && y >= 120 && y < 264; }

// A bag lies there until frame kLeaves. In frames passes .. passes + 7 somebody is before its
// place. Returns the background's red there, mean, of each frame, divided by its light.
std::vector<double> red_of(
    int passes, const std::function<double(int frame)>& light = [](int) { return 1.0; }) {
  EngineOptions options = robust_of(100);
  options.mode = Mode::live;
  options.threads = 2;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  std::vector<double> red;
  std::mt19937 rng(418);
  std::vector<uint8_t> frame(3 * kPixels);
  for (int t = 0; t < kFrames; ++t) {
    for (size_t i = 0; i < 3 * kPixels; ++i) {
      const int x = static_cast<int>(i % kPixels) % kWidth,
                y = static_cast<int>(i % kPixels) / kWidth;
      int level = kFloor + (x / 16 + y / 16) % 5;
      if (in_bag(x, y) && t < kLeaves) level = kBag;
      if (in_bag(x, y) && t >= passes && t < passes + 8) level = kPasser;
      frame[i] = static_cast<uint8_t>(light(t) * level + static_cast<double>(rng() % 4));
    }
    PackedPicture picture(kWidth, kHeight), background(kWidth, kHeight);
    picture.fill(frame);
    EXPECT_TRUE(engine.push(picture.in()).ok());
    engine.next()->pop(Output::background, background.out());
    double sum = 0, pixels = 0;
    for (int y = 130; y < 254; ++y)
      for (int x = 250; x < 374; ++x) {
        sum += background.at(0, static_cast<size_t>(y * kWidth + x));
        ++pixels;
      }
    red.push_back(sum / pixels / light(t));
  }
  return red;
}

// It was seen for kSteady frames, and the solve that has the bag comes into use while somebody is
// before it.
TEST(LiveMending, TakesNoPasserByForWhatWasHidden) {
  for (int passes : {kFrames, kLeaves + StandingLooks::kSteady, kSolve + kPiece - 2}) {
    const auto red = red_of(passes);
    EXPECT_NEAR(red[kLeaves - 1], kBag + 2, 4);
    EXPECT_NEAR(red[kLeaves + StandingLooks::kSteady], kFloor + 4, 4) << passes;
    double most = 0;
    for (int t = kLeaves; t < kFrames; ++t) most = std::max(most, red[static_cast<size_t>(t)]);
    EXPECT_NEAR(most, kFloor + 4, 4) << passes;
    // For a moment the solve's bag is back; then there are enough frames without a passer-by.
    for (int t = kSolve + kPiece + 18; t < kFrames; ++t)
      EXPECT_NEAR(red[static_cast<size_t>(t)], kFloor + 4, 4) << t << ", passes " << passes;
  }
}

// Lamps flicker: what a place shows is taken from frames of different light.
TEST(LiveMending, TakesEachFrameInItsOwnLight) {
  const auto light = [](int t) {
    return std::array{1.0, 0.6, 0.8}[static_cast<size_t>(t / 2 % 3)];
  };
  const auto red = red_of(kFrames, light);
  // In the light of most frames.
  const double unit = red[kLeaves - 1] / (kBag + 2);
  EXPECT_NEAR(unit, 1, 0.1);
  // The solve's bag is back until its floor has been seen for kSteady frames in its light.
  for (int t = kLeaves + StandingLooks::kSteady; t < kFrames; ++t) {
    if (t < kSolve + kPiece - 2 || t > kSolve + kPiece + StandingLooks::kSteady) {
      EXPECT_NEAR(red[static_cast<size_t>(t)], kFloor + 4, 5) << t;
    }
  }
}

}  // namespace
}  // namespace qdmd::test
