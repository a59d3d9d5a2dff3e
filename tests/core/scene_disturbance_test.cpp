// SPDX-License-Identifier: LGPL-2.1-or-later
// Disturbances: when they are there, what they show, and that the truth goes on as without them.
#include <algorithm>
#include <set>

#include "core/scene/effects/times.h"
#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

constexpr int kWidth = 96, kHeight = 72;

// ---- Times ----

TEST(SceneTimes, BeginLastAndComeAgain) {
  constexpr double kOnce[] = {2, 0.5, 0}, kAgain[] = {2, 0.5, 3}, kNever[] = {2, 0, 0};
  for (const int rate : {10, 24, 25, 30, 60})
    for (int64_t k = 0; k < 20 * rate; ++k) {
      const double time = static_cast<double>(k) * (1.0 / rate);
      // In integers: halves of a frame's time.
      const int64_t passed = 2 * k - 4 * rate;
      EXPECT_EQ(scene::Times(kOnce).on(time), passed >= 0 && passed < rate) << rate << ' ' << k;
      EXPECT_EQ(scene::Times(kAgain).on(time), passed >= 0 && passed % (6 * rate) < rate)
          << rate << ' ' << k;
      EXPECT_FALSE(scene::Times(kNever).on(time));
      if (const auto since = scene::Times(kAgain).since(time)) {
        EXPECT_NEAR(*since, static_cast<double>(passed % (6 * rate)) / 2 / rate, 1e-6);
      }
    }
}

constexpr const char* kDisturbances[] = {"fog",   "focus-search", "lost-blocks:length=1",
                                         "smear", "lost-signal",  "frozen"};

// The truth is that of the scene without the disturbance; so are frames before and after it.
TEST(SceneDisturbance, TheTruthGoesOnWithoutIt) {
  for (const std::string name : kDisturbances)
    for (const std::string scene : {"default", "bootstrap,leaves,fade,noise",
                                    "jitter=2,shadow,motion-blur,remove=1,exposure"}) {
      Scene with(options(kWidth, kHeight), name + ":from=1.2:seconds=0.4:every=2," + scene),
          plain(options(kWidth, kHeight), scene);
      int disturbed = 0;
      for (int64_t k = 0; k < 100; ++k) {
        Shot a = shoot(&with, k);
        const Shot b = shoot(&plain, k);
        const bool there = k >= 30 && (k - 30) % 50 < 10;
        disturbed += a.frame != b.frame;
        if (!there) {
          EXPECT_EQ(a.frame, b.frame) << name << " frame " << k;
        }
        a.frame = b.frame;
        EXPECT_TRUE(a == b) << name << " changes the truth of " << scene << " at frame " << k;
      }
      // The first of ten frozen frames is itself, and so is fog in the moment in which it comes.
      EXPECT_GE(disturbed, 18) << name << ' ' << scene;
      EXPECT_LE(disturbed, 20) << name << ' ' << scene;
    }
}

// ---- What is seen ----

// The frames in the middle of a disturbance, with it and without.
std::pair<Shot, Shot> seen(const std::string& effect, const std::string& scene = "default",
                           int64_t index = 55) {
  Scene with(options(kWidth, kHeight), scene + ',' + effect),
      plain(options(kWidth, kHeight), scene);
  return {shoot(&with, index), shoot(&plain, index)};
}

TEST(SceneLostSignal, IsFlatWithItsNoise) {
  for (const int level : {16, 128, 200})
    for (const double deviation : {0.0, 2.0, 5.0}) {
      const auto [lost, plain] =
          seen("lost-signal=" + std::to_string(level) + ":deviation=" + std::to_string(deviation));
      double sum = 0, squares = 0;
      for (const uint8_t sample : lost.frame)
        sum += sample - level, squares += (sample - level) * (sample - level);
      const auto n = static_cast<double>(lost.frame.size());
      // Rounding adds 1/12 where there is noise. 4.5 sigma.
      const double variance = deviation > 0 ? deviation * deviation + 1 / 12.0 : 0;
      EXPECT_NEAR(sum / n, 0, 4.5 * std::sqrt(variance / n) + 1e-12) << level;
      EXPECT_NEAR(squares / n, variance, 4.5 * variance * std::sqrt(2 / n) + 1e-12) << level;
    }
  // Frames differ.
  EXPECT_NE(seen("lost-signal", "default", 55).first.frame,
            seen("lost-signal", "default", 56).first.frame);
}

TEST(SceneSmear, TheLastWholeRowIsSeenBelow) {
  for (const auto& [top, whole] : {std::pair{"0", 1}, {"0.25", 18}, {"0.5", 36}, {"1", 72}}) {
    const auto [smeared, plain] = seen("smear=" + std::string(top), "noise");
    for (int y = 0; y < kHeight; ++y) {
      const auto row = [&](const Shot& shot, int from) {
        const auto begin = shot.frame.begin() + from * kWidth * 3;
        return std::vector<uint8_t>(begin, begin + kWidth * 3);
      };
      EXPECT_EQ(row(smeared, y), row(plain, std::min(y, whole - 1))) << top << " row " << y;
    }
  }
}

// The blocks of 16 x 16 pixels that are not what the scene shows.
std::set<int> changed_blocks(const Shot& a, const Shot& b) {
  constexpr int kColumns = kWidth / 16;
  std::set<int> blocks;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto at = static_cast<size_t>(y * kWidth + x) * 3;
      if (!std::equal(&a.frame[at], &a.frame[at] + 3, &b.frame[at]))
        blocks.insert(y / 16 * kColumns + x / 16);
    }
  return blocks;
}

TEST(SceneLostBlocks, AsManyPacketsAreLostAsItSays) {
  // 30 blocks, the lowest row cut off; the noise shows each block that comes from elsewhere.
  constexpr int kBlocks = kWidth / 16 * 5;
  for (const double share : {0.2, 0.6, 1.0})
    for (const int length : {1, 4}) {
      double lost = 0, packets = 0;
      for (int64_t k = 50; k < 62; ++k)
        for (const char* noise : {"noise", "noise=5"}) {
          const auto [damaged, plain] =
              seen("lost-blocks=" + std::to_string(share) + ":length=" + std::to_string(length),
                   noise, k);
          const std::set<int> blocks = changed_blocks(damaged, plain);
          // All of a packet, or nothing.
          for (int first = 0; first < kBlocks; first += length, ++packets) {
            const int last = std::min(first + length, kBlocks) - 1;
            EXPECT_EQ(blocks.count(first), blocks.count(last)) << length;
            lost += static_cast<double>(blocks.count(first));
          }
        }
      // Both noises see the same packets. 4.5 sigma.
      EXPECT_NEAR(lost / packets, share, 4.5 * std::sqrt(share * (1 - share) / (packets / 2)));
    }
}

TEST(SceneFocusSearch, IsSeenThroughALensOutOfFocus) {
  const auto [blurred, sharp] = seen("focus-search=2");
  Scene lens(options(kWidth, kHeight), "defocus=2");
  const Shot defocused = shoot(&lens, 55);
  // Away from the frame's rim, where the lens sees what is beside it, both are the same filter; the
  // lens cuts it off at three deviations.
  for (int y = 12; y < kHeight - 12; ++y)
    for (int x = 12; x < kWidth - 12; ++x)
      for (int c = 0; c < 3; ++c) {
        const auto at = static_cast<size_t>(y * kWidth + x) * 3 + static_cast<size_t>(c);
        ASSERT_NEAR(blurred.frame[at], defocused.frame[at], 2) << x << ", " << y;
      }
  EXPECT_NE(blurred.frame, sharp.frame);
}

TEST(SceneFog, HidesMostInItsMiddle) {
  for (const double density : {0.3, 1.0})
    for (const auto& [index, share] : {std::pair{50, 0.0}, {100, 0.5}, {150, 1.0}, {200, 0.5}}) {
      const auto [hazy, clear] = seen("fog=" + std::to_string(density), "default", index);
      for (size_t i = 0; i < hazy.frame.size(); ++i)
        ASSERT_NEAR(hazy.frame[i], clear.frame[i] + (190 - clear.frame[i]) * density * share,
                    0.5 + 1e-6)
            << index;
    }
}

TEST(SceneFrozen, TheFirstFrameIsSeenToTheEnd) {
  for (const double rate : {2.0, 24.0, 25.0, 30.0})
    for (const std::string scene : {"noise", "jitter,leaves,noise"}) {
      const auto how = options(32, 24, rate);
      Scene frozen(how, "frozen=2:seconds=2:every=3," + scene), plain(how, scene);
      for (int64_t k = 0; k < static_cast<int64_t>(9 * rate); ++k) {
        const auto second = static_cast<int64_t>(rate), since = k - 2 * second;
        const int64_t within = since < 0 ? 0 : since % (3 * second);
        const int64_t seen = within < 2 * second ? k - within : k;
        EXPECT_EQ(shoot(&frozen, k, scene::kFrame).frame, shoot(&plain, seen, scene::kFrame).frame)
            << rate << " frame " << k;
      }
    }
}

// ---- The clock ----

TEST(SceneClock, ChangesOnceASecondInItsPlaceAndNoTruth) {
  const std::string scene = "jitter,noise";
  for (const auto& [name, left, top] :
       {std::tuple{"clock", true, false}, {"clock=0.1:x=0:y=1", false, true}}) {
    auto how = options(160, 120);
    Scene with(how, scene + "," + name), plain(how, scene);
    std::vector<uint8_t> before;
    int changes = 0;
    for (int64_t k = 0; k < 75; ++k) {
      Shot a = shoot(&with, k);
      const Shot b = shoot(&plain, k);
      std::vector<uint8_t> text;
      for (size_t i = 0; i < a.frame.size(); ++i) {
        const size_t x = i / 3 % 160, y = i / 480;
        if (a.frame[i] == b.frame[i]) continue;
        EXPECT_TRUE(left ? x > 40 : x < 120) << x;
        EXPECT_TRUE(top ? y > 90 : y < 30) << y;
      }
      for (size_t y = top ? 90 : 0; y < (top ? 120 : 30); ++y)
        for (size_t x = 0; x < 160; ++x) {
          const size_t i = 3 * (160 * y + x);
          // White strokes: nothing else there is so bright in all channels.
          text.push_back(a.frame[i] == 235 && a.frame[i + 1] == 235 && a.frame[i + 2] == 235 &&
                         a.frame[i] != b.frame[i]);
        }
      EXPECT_LT(20, std::count(text.begin(), text.end(), 1));
      changes += k > 0 && text != before;
      before = text;
      a.frame = b.frame;
      EXPECT_TRUE(a == b) << k;
    }
    EXPECT_GE(changes, 2);
    EXPECT_LE(changes, 8);  // noise may make the same level behind a stroke
  }
}

}  // namespace
}  // namespace qdmd::test
