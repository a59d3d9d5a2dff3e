// SPDX-License-Identifier: LGPL-2.1-or-later
// The light of frames of cells: gains that are known are found, and what moves is none.
#include "core/learn/robust/light.h"

#include <algorithm>
#include <random>
#include <vector>

#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

// A textured background of `grid` in each frame's light, with noise and a box of `box` cells'
// width and height that moves; box 0: none.
GridFrames lit_frames(const Grid& grid, const std::vector<Gain>& gains, int box, uint32_t seed) {
  std::mt19937 rng(seed);
  std::normal_distribution<float> noise(0, 0.5f);
  const GridFrames background = random_frames(grid, 1, 30, 160, rng);
  const int count = static_cast<int>(gains.size());
  GridFrames frames(grid, count);
  for (int t = 0; t < count; ++t) {
    const int x0 = box > 0 ? t * 3 % std::max(1, grid.cols - box) : 0;
    const int y0 = box > 0 ? t * 2 % std::max(1, grid.rows - box) : 0;
    for (int y = 0; y < grid.rows; ++y)
      for (int x = 0; x < grid.cols; ++x) {
        const auto i = static_cast<size_t>(y * grid.cols + x);
        const bool in_box = x >= x0 && x < x0 + box && y >= y0 && y < y0 + box;
        for (int c = 0; c < kChannels; ++c) {
          const float own =
              in_box ? 40.0f + 70.0f * static_cast<float>((c + t) % 3) : background.plane(0, c)[i];
          frames.plane(t, c)[i] =
              std::clamp(own * gains[static_cast<size_t>(t)][static_cast<size_t>(c)] + noise(rng),
                         0.0f, 255.0f);
        }
      }
  }
  return frames;
}

// Within 1 %, relative to frame 0.
void expect_gains(const std::vector<Gain>& found, const std::vector<Gain>& truth) {
  ASSERT_EQ(found.size(), truth.size());
  for (size_t t = 0; t < truth.size(); ++t)
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(found[t][c] / found[0][c] / (truth[t][c] / truth[0][c]), 1, 0.01)
          << "frame " << t << " channel " << c;
}

TEST(LightOf, KnownGainsAreFound) {
  const Grid grid = grid_of(20, 30);
  for (int box : {0, 6, 10})
    for (float other : {0.4f, 0.6f, 0.8f, 1.2f, 1.5f}) {
      SCOPED_TRACE(testing::Message() << "box " << box << " gain " << other);
      std::vector<Gain> truth(40, kSameLight);
      // A minority in another light.
      for (size_t t = 25; t < 37; ++t) truth[t] = {other, other, other};
      expect_gains(light_of(lit_frames(grid, truth, box, 3), 40).gains, truth);
      // Half and half: no light is the usual one.
      for (size_t t = 20; t < 40; ++t) truth[t] = {other, other, other};
      expect_gains(light_of(lit_frames(grid, truth, box, 4), 40).gains, truth);
    }
}

TEST(LightOf, ColoursOfLightAreFound) {
  const Grid grid = grid_of(24, 24);
  std::vector<Gain> truth(30, kSameLight);
  for (size_t t = 18; t < 30; ++t) truth[t] = {0.85f, 0.75f, 0.65f};
  expect_gains(light_of(lit_frames(grid, truth, 6, 9), 30).gains, truth);
}

// Where most of a channel is at the end of its range, the few cells that are left of it are not
// taken for a colour of the light.
TEST(LightOf, WhatIsTooBrightIsNoColour) {
  const Grid grid = grid_of(20, 30);
  std::mt19937 rng(5);
  GridFrames frames = random_frames(grid, 1, 40, 150, rng);
  GridFrames both(grid, 2);
  for (int c = 0; c < kChannels; ++c)
    for (size_t i = 0; i < grid.cells(); ++i) {
      float level = frames.plane(0, c)[i];
      // All of green but one cell in forty is bright; the light of these is a shade's.
      const bool green = c == 1, shaded = green && i % 40 == 0;
      if (green && !shaded) level += 100;
      both.plane(0, c)[i] = std::min(255.0f, level);
      both.plane(1, c)[i] = std::min(255.0f, (shaded ? 1.62f : 1.7f) * level);
    }
  LightScratch scratch(grid.cells());
  const Gain gain = light_over(both, 1, both, 0, &scratch);
  for (const float of_channel : gain) EXPECT_NEAR(of_channel, 1.7f, 0.017f);
}

// Frames near the middle light are left to refine_gain(): they agree with it within its tolerance.
TEST(LightOf, AFadeIsFollowed) {
  const Grid grid = grid_of(20, 30);
  std::vector<Gain> truth;
  for (int t = 0; t < 60; ++t) {
    const float gain = 1 - 0.4f * static_cast<float>(t) / 59;
    truth.push_back({gain, gain, gain});
  }
  const auto found = light_of(lit_frames(grid, truth, 7, 11), 60).gains;
  // The light of what was left as it is.
  double base = 0;
  int unlit = 0;
  for (size_t t = 0; t < truth.size(); ++t)
    if (!is_lit(found[t])) base += truth[t][1], ++unlit;
  base = unlit > 0 ? base / unlit : truth[30][1] / found[30][1];
  for (size_t t = 0; t < truth.size(); ++t)
    EXPECT_NEAR(found[t][1] * base / truth[t][1], 1, is_lit(found[t]) ? 0.03 : 0.06) << t;
}

TEST(LightOf, SmallChangesAreNoise) {
  const Grid grid = grid_of(20, 30);
  std::mt19937 rng(12);
  std::normal_distribution<float> flicker(0, 0.01f);
  std::vector<Gain> truth(30);
  for (Gain& gain : truth) gain.fill(1 + flicker(rng));
  for (const Gain& gain : light_of(lit_frames(grid, truth, 6, 13), 30).gains)
    EXPECT_FALSE(is_lit(gain));
}

TEST(LightOf, WhatMovesIsNoLight) {
  std::mt19937 rng(14);
  const Grid grid = grid_of(20, 30);
  for (float high : {120.0f, 250.0f})
    for (const Gain& gain : light_of(random_frames(grid, 30, 10, high, rng), 30).gains)
      EXPECT_FALSE(is_lit(gain));
  // A wide texture that pans.
  const Grid wide = grid_of(20, 300);
  const GridFrames texture = random_frames(wide, 1, 20, 230, rng);
  GridFrames pan(grid, 40);
  for (int t = 0; t < 40; ++t)
    for (int c = 0; c < kChannels; ++c)
      for (int y = 0; y < 20; ++y)
        std::copy_n(texture.plane(0, c) + y * 300 + 5 * t, 30, pan.plane(t, c) + y * 30);
  for (const Gain& gain : light_of(pan, 40).gains) EXPECT_FALSE(is_lit(gain));
}

// Leaves that are darker than what is behind hide most of it: from frame to frame, too little stays
// to say what a frame's light is.
TEST(LightOf, LeavesAreNoLight) {
  const Grid grid = grid_of(24, 32);
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    std::mt19937 rng(seed);
    std::normal_distribution<float> noise(0, 0.5f);
    std::uniform_real_distribution<float> share(0, 1);
    const GridFrames background = random_frames(grid, 1, 80, 120, rng);
    constexpr int kCount = 120;
    GridFrames frames(grid, kCount);
    for (int t = 0; t < kCount; ++t) {
      // For a third of the time they hide nearly all.
      const float hidden = t / 8 % 3 == 0 ? 0.9f : 0.3f;
      for (size_t i = 0; i < grid.cells(); ++i) {
        const bool hides = share(rng) < hidden;
        const float level = 25 + 30 * share(rng);
        for (int c = 0; c < kChannels; ++c)
          frames.plane(t, c)[i] =
              (hides ? level * (c == 1 ? 1.2f : 0.8f) : background.plane(0, c)[i]) + noise(rng);
      }
    }
    for (const Gain& gain : light_of(frames, kCount).gains)
      for (float of_channel : gain) EXPECT_NEAR(of_channel, 1, 0.03) << "seed " << seed;
  }
}

TEST(LightOf, NothingToSeeIsTheSameLight) {
  const Grid grid = grid_of(4, 4);
  for (float level : {0.0f, 5.0f, 255.0f})
    for (int count : {1, 2, 9}) {
      GridFrames frames(grid, count);
      for (int t = 0; t < count; ++t)
        for (int c = 0; c < kChannels; ++c) std::fill_n(frames.plane(t, c), grid.cells(), level);
      for (const Gain& gain : light_of(frames, count).gains) EXPECT_EQ(gain, kSameLight);
    }
}

TEST(SettleLight, TheUsualLightBecomesOne) {
  std::vector<Gain> gains(10, Gain{1.2f, 1.1f, 1.3f});
  for (size_t t = 6; t < 10; ++t) gains[t] = {0.6f, 0.55f, 0.65f};
  gains[1] = {1.22f, 1.12f, 1.32f};  // noise
  settle_light(&gains);
  for (size_t t = 0; t < 6; ++t) EXPECT_EQ(gains[t], kSameLight);
  for (size_t t = 6; t < 10; ++t)
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(gains[t][c], 0.5f, 1e-5);
}

TEST(SettleLight, WithoutAUsualLightNothingIsDone) {
  std::vector<Gain> gains;
  for (int t = 0; t < 20; ++t)
    gains.push_back(Gain{1, 1, 1}), gains.back().fill(0.5f + 0.1f * static_cast<float>(t));
  const auto before = gains;
  settle_light(&gains);
  EXPECT_EQ(gains, before);
}

// The edge is soft: a change a little above the limit must not jump.
TEST(SettleLight, IsMonotonicAndContinuous) {
  float last = 1;
  for (int k = 0; k <= 200; ++k) {
    std::vector<Gain> gains(9, kSameLight);
    gains[8].fill(1 + 0.001f * static_cast<float>(k));
    settle_light(&gains);
    EXPECT_GE(gains[8][0], last);
    EXPECT_LT(gains[8][0], last + 0.004f);
    EXPECT_LE(gains[8][0], 1 + 0.001f * static_cast<float>(k) + 1e-6f);
    last = gains[8][0];
  }
  EXPECT_NEAR(last, 1.2f, 1e-5);
}

// Frames whose light is not looked for anew: what light_over() finds in each.
TEST(LightOfFrames, IsThatOfEachFrame) {
  const Grid grid = grid_of(24, 32);
  for (int box : {0, 8, 16})
    for (uint32_t seed : {5u, 6u}) {
      SCOPED_TRACE(testing::Message() << "box " << box << " seed " << seed);
      std::vector<Gain> truth;
      const auto add = [&](int count, float first, float last) {
        for (int t = 0; t < count; ++t) {
          const float gain =
              first + (last - first) * static_cast<float>(t) / static_cast<float>(count);
          truth.push_back({gain, gain, gain});
        }
      };
      // It rests, is switched, comes back, and fades slowly to and fro.
      add(12, 1, 1), add(5, 0.7f, 0.7f), add(9, 1, 1), add(60, 1, 1.4f), add(60, 1.4f, 1);
      add(4, 1, 1);
      const GridFrames frames = lit_frames(grid, truth, box, seed);
      GridFrames background(grid, 2);
      const GridFrames alone = lit_frames(grid, {kSameLight}, 0, seed);
      for (int picture = 0; picture < 2; ++picture)
        for (int c = 0; c < kChannels; ++c)
          std::copy_n(alone.plane(0, c), grid.cells(), background.plane(picture, c));
      // Another background, which nothing agrees with, must leave no trace.
      for (int c = 0; c < kChannels; ++c)
        for (size_t i = 0; i < grid.cells(); ++i) background.plane(1, c)[i] *= 0.5f;
      LightOfFrames followed(grid.cells());
      LightScratch scratch(grid.cells());
      for (int t = 0; t < frames.size(); ++t) {
        const Gain slow = light_over(frames, t, background, 0, &scratch);
        const Gain fast = followed.over(frames, t, background, 0);
        for (size_t c = 0; c < kChannels; ++c) ASSERT_EQ(fast[c], slow[c]) << t;
      }
      followed.forget();
      for (int t = 0; t < frames.size(); t += 10)
        ASSERT_EQ(followed.over(frames, t, background, 1),
                  light_over(frames, t, background, 1, &scratch))
            << t;
    }
}

}  // namespace
}  // namespace qdmd::test
