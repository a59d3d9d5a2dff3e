// SPDX-License-Identifier: LGPL-2.1-or-later
// Effects on light, weather, focus and coding against their formulas.
#include <algorithm>
#include <complex>
#include <limits>
#include <numbers>

#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

// ---- Curves of light ----

// Mean levels, all channels, of the background with the light and without: they differ by rounding.
void expect_light(const std::string& text, double rate, int64_t index, double factor) {
  Scene lit(options(64, 48, rate), text), plain(options(64, 48, rate), "default");
  lit.render(index, kEverything);
  plain.render(index, kEverything);
  for (const double gain : lit.light().gain)
    EXPECT_NEAR(gain, factor, 1e-9) << text << ' ' << index;
  for (size_t i = 0; i < plain.background().samples.size(); ++i) {
    const double expected = std::min(255.0, plain.background().samples[i] * factor);
    ASSERT_NEAR(lit.background().samples[i], expected, 0.5 + 1e-6) << text << ' ' << index;
    const double seen = std::min(255.0, plain.frame().samples[i] * factor);
    ASSERT_NEAR(lit.frame().samples[i], seen, 0.5 + 1e-6) << text << ' ' << index;
  }
}

TEST(SceneFade, FollowsItsRamp) {
  for (const int64_t k : {0, 1, 50, 100, 199, 200, 201, 100000})
    expect_light("fade", 25, k, 1 - 0.4 * std::min(1.0, static_cast<double>(k) / 200));
  for (const int64_t k : {0, 20, 40, 60, 80, 100})
    expect_light("fade=-0.5:duration=4:from=3", 10, k,
                 1 + 0.5 * std::clamp((static_cast<double>(k) / 10 - 3) / 4, 0.0, 1.0));
  expect_light("fade=1:duration=1", 10, 10, 0);
}

TEST(SceneLightSwitch, SwitchesEveryFewSeconds) {
  for (const double rate : {10.0, 24.0, 25.0, 30.0, 60.0})
    for (const int64_t turn : {0, 1, 2, 3, 4, 1001, 100002}) {
      const auto first = static_cast<int64_t>(std::lround(static_cast<double>(turn) * 4 * rate));
      expect_light("light-switch", rate, first, turn % 2 ? 0.65 : 1);
      if (turn > 0) expect_light("light-switch", rate, first - 1, turn % 2 ? 1 : 0.65);
    }
}

TEST(SceneLightSwitch, RoundedTimesAreNoFrameLate) {
  for (const auto& [rate, tenths] : {std::pair{30, 1}, {30, 7}, {60, 3}, {10, 3}, {20, 9}}) {
    Scene scene(options(2, 2, rate), "light-switch:seconds=0." + std::to_string(tenths));
    for (int64_t k = 0; k < 5000; ++k) {
      scene.render(k, scene::kBoxes);
      // In integers: k / rate seconds hold so many whole switches.
      const bool dark = k * 10 / (rate * tenths) % 2 == 1;
      ASSERT_NEAR(scene.light().gain[0], dark ? 0.65 : 1, 1e-9) << rate << " f/s, frame " << k;
    }
  }
}

TEST(SceneNight, LeavesLittleBlueLight) {
  for (const auto& [light, gain] : {std::pair{0.04, 18.0}, {0.2, 6.0}, {0.01, 40.0}}) {
    Scene night(options(64, 48),
                "night=" + std::to_string(light) + ":gain=" + std::to_string(gain)),
        day(options(64, 48), "default");
    const Shot dark = shoot(&night, 30), bright = shoot(&day, 30);
    const double colour[3] = {0.85, 0.95, 1.2};
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(dark.gain[c], light * std::pow(10, gain / 20) * colour[c], 1e-9);
    // The background is before noise.
    for (size_t i = 0; i < dark.background.size(); ++i)
      ASSERT_NEAR(dark.background[i], std::min(255.0, bright.background[i] * dark.gain[i % 3]),
                  0.5 + 1e-6);
  }
}

TEST(SceneLight, FactorsMultiply) {
  Scene all(options(16, 12), "fade,light-switch");
  for (const int64_t k : {0, 150, 250, 320})
    EXPECT_NEAR(shoot(&all, k).gain[0],
                (1 - 0.4 * std::min(1.0, static_cast<double>(k) / 200)) * (k / 100 % 2 ? 0.65 : 1),
                1e-9);
}

TEST(SceneBands, RowsFollowASineOfTheRightPeriod) {
  constexpr int kWidth = 160, kHeight = 240;
  Scene banded(options(kWidth, kHeight), "bands"), plain(options(kWidth, kHeight), "default");
  for (const int64_t k : {0, 1, 7, 40}) {
    const Shot shot = shoot(&banded, k), still = shoot(&plain, k);
    std::vector<double> profile;
    for (size_t y = 0; y < kHeight; ++y) {
      double lit = 0, dark = 0, samples = 0;
      for (size_t i = y * kWidth * 3; i < (y + 1) * kWidth * 3; ++i) {
        // Brighter ones are clipped.
        if (still.background[i] > 230) continue;
        lit += shot.background[i], dark += still.background[i], ++samples;
      }
      profile.push_back(lit / dark - 1);
      // 120 Hz, seen by rows that follow each other by 0.8 / 25 / 240 s.
      const double time = static_cast<double>(k) / 25 + static_cast<double>(y) * 0.8 / 25 / kHeight;
      const double expected = 0.1 * std::sin(2 * std::numbers::pi * 120 * time);
      EXPECT_NEAR(shot.rows[y] - 1, expected, 1e-9);
      // Half a level of rounding in the mean of the row.
      EXPECT_NEAR(profile[y], expected, 0.5 * samples / dark) << k << " row " << y;
    }
    // The profile has most of the period of 240 / 3.84 rows, among all of them.
    double best = 0, best_turns = 0;
    for (double turns = 1; turns < 8; turns += 0.02) {
      std::complex<double> sum = 0;
      for (size_t y = 0; y < kHeight; ++y)
        sum +=
            std::polar(profile[y], 2 * std::numbers::pi * turns * static_cast<double>(y) / kHeight);
      if (std::abs(sum) > best) best = std::abs(sum), best_turns = turns;
    }
    // The other side of the spectrum, 7.7 lines off, moves the maximum by less than 0.1.
    EXPECT_NEAR(best_turns, 3.84, 0.1) << k;
  }
}

// ---- Exposure ----

double gain_at(const std::string& text, double time) {
  Scene scene(options(64, 48, 100), text);
  scene.render(std::lround(time * 100), kEverything);
  return scene.light().gain[1];
}

TEST(SceneExposure, TakesBackItsShareOfAStepInTheEnd) {
  // The mover is metered as well, at the same times in both scenes: in the quotient all that is
  // left of a step to 0.6 once the past of 5 lags is dark is 0.6^(1 - strength).
  for (const double strength : {0.0, 0.5, 0.8, 1.0}) {
    const std::string camera = "exposure=" + std::to_string(strength);
    const std::string step = "fade=0.4:duration=0.001:from=3,";
    EXPECT_NEAR(gain_at(step + camera, 9) / gain_at(camera, 9), std::pow(0.6, 1 - strength), 1e-9);
    EXPECT_NEAR(gain_at(step + camera, 2.9) / gain_at(camera, 2.9), 1, 1e-9);
    // At first the picture is as dark as the light.
    EXPECT_NEAR(gain_at(step + camera, 3.01) / gain_at(camera, 3.01), 0.6, 0.6 * 0.05);
  }
}

TEST(SceneExposure, LagsByItsTimeConstant) {
  for (const double lag : {0.5, 2.0}) {
    const std::string camera = "exposure=1:lag=" + std::to_string(lag);
    const std::string step = "fade=0.4:duration=0.001:from=20,";
    for (const double lags : {0.5, 1.0, 2.0, 3.0}) {
      const double time = 20 + lags * lag;
      // What the camera still remembers of the light.
      const double metered = 0.6 * gain_at(camera, time) / gain_at(step + camera, time);
      const double remembered = (metered - 0.6) / 0.4;
      // The past is sampled each tenth of a lag, as far as 5 lags; the mover, 7 % of the picture
      // and at most half as bright or twice as bright, weighs what it covers differently by 4 %.
      const double full = 1 - std::exp(-5.0);
      EXPECT_GT(remembered, (std::exp(-lags - 0.1) - std::exp(-5.0)) / full - 0.04) << lags;
      EXPECT_LT(remembered, (std::exp(-lags + 0.1) - std::exp(-5.0)) / full + 0.04) << lags;
    }
  }
}

TEST(SceneExposure, AnEmptyStreetByDayIsItsTarget) {
  // One instant of memory at a time when nobody is in view.
  Scene scene(options(64, 48, 100), "exposure=1:lag=0.01");
  EXPECT_NEAR(shoot(&scene, 0).gain[0], 1, 1e-9);
}

// ---- Weather ----

TEST(SceneRain, DropsAreAsManyAndAsBrightAsTheySay) {
  constexpr int kFrames = 40, kWidth = 160, kHeight = 120;
  constexpr double kDensity = 2, kBright = 20;
  // Drops of one pixel.
  Scene rain(options(kWidth, kHeight), "rain=2:length=0.001:brightness=20"),
      dry(options(kWidth, kHeight), "default");
  double sum = 0, wet = 0;
  for (int64_t k = 0; k < kFrames; ++k) {
    const Shot drops = shoot(&rain, k), none = shoot(&dry, k);
    EXPECT_EQ(drops.background, none.background);
    EXPECT_EQ(drops.labels, none.labels);
    for (size_t i = 0; i < drops.frame.size(); i += 3) {
      ASSERT_GE(drops.frame[i], none.frame[i]);
      sum += drops.frame[i] - none.frame[i];
      wet += drops.frame[i] != none.frame[i];
    }
  }
  // So many in all, of which one row in 121 lies outside, each of 0.4 to 1 of the brightness.
  const double drops = kFrames * kDensity * kWidth * kHeight / 1000;
  const double seen = drops * kHeight / (kHeight + 1);
  const double each = 0.7 * kBright, variance = kBright * kBright * 0.36 / 12 + 1 / 12.0;
  // 4.5 sigma: their number is fixed up to one a frame, which ones are seen is not.
  const double hidden = seen / (kHeight + 1);
  EXPECT_NEAR(sum, seen * each,
              4.5 * std::sqrt(seen * variance + (hidden + kFrames / 4.0) * each * each));
  // 38 drops a frame on 19200 pixels: of pairs on one pixel 1.5 in all.
  EXPECT_NEAR(wet, seen - 1.5, 4.5 * std::sqrt(hidden + kFrames / 4.0 + 1.5));
}

TEST(SceneRain, FramesHaveOtherDropsAndStreaksTheirLength) {
  Scene rain(options(160, 120), "rain=0.05:length=0.2"), dry(options(160, 120), "default");
  int columns_of_streaks = 0;
  std::vector<uint8_t> last;
  for (int64_t k = 0; k < 30; ++k) {
    const Shot drops = shoot(&rain, k), none = shoot(&dry, k);
    EXPECT_NE(drops.frame, last);
    last = drops.frame;
    int rows = 0;
    for (size_t y = 0; y < 120; ++y)
      rows += !std::equal(&drops.frame[y * 480], &drops.frame[y * 480] + 480, &none.frame[y * 480]);
    // One drop a frame, of 24 rows, cut off at the ends; seldom two.
    EXPECT_LE(rows, 48);
    columns_of_streaks += rows == 24;
  }
  EXPECT_GT(columns_of_streaks, 8);
}

TEST(SceneSnow, FlakesAreAsManyAsTheySay) {
  constexpr int kSeeds = 60, kWidth = 160, kHeight = 120;
  double white = 0;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    // Flakes of one pixel's diameter.
    Scene snow(options(kWidth, kHeight, 25, seed), "snow=2:size=0.001"),
        clear(options(kWidth, kHeight, 25, seed), "default");
    const Shot flakes = shoot(&snow, 33), none = shoot(&clear, 33);
    EXPECT_EQ(flakes.background, none.background);
    EXPECT_EQ(flakes.labels, none.labels);
    for (size_t i = 0; i < flakes.frame.size(); i += 3) {
      const bool flake =
          flakes.frame[i] == 238 && flakes.frame[i + 1] == 240 && flakes.frame[i + 2] == 245;
      white += flake;
      EXPECT_TRUE(flake || flakes.frame[i] == none.frame[i]);
    }
  }
  // 38 flakes, each around the middle of a pixel with probability pi / 4, along a way of 121 rows.
  const double pixels = kWidth * kHeight;
  const double q = std::numbers::pi / 4 / (kWidth * (kHeight + 1));
  const double expected = kSeeds * pixels * (1 - std::pow(1 - q, 38));
  const double share = q * pixels;
  // 4.5 sigma of a binomial number.
  EXPECT_NEAR(white, expected, 4.5 * std::sqrt(kSeeds * 38 * share * (1 - share)));
}

TEST(SceneSnow, FlakesFallAtTheirSpeed) {
  // All at 0.5 to 1 of a quarter of the height per second: none is still or jumps.
  Scene snow(options(100, 200, 50), "snow=0.1:size=0.05:speed=0.25"),
      clear(options(100, 200, 50), "default");
  const auto rows = [&](int64_t k) {
    double sum = 0, n = 0;
    const Shot flakes = shoot(&snow, k), none = shoot(&clear, k);
    for (size_t i = 0; i < flakes.frame.size(); i += 3)
      if (flakes.frame[i] == 238 && none.frame[i] != 238) sum += static_cast<double>(i / 300), ++n;
    return sum / n;
  };
  int down = 0;
  for (int64_t k = 0; k < 100; k += 5) {
    const double fallen = rows(k + 5) - rows(k);
    down += fallen > 0.1 * 200 * 0.25 * 0.5 && fallen < 0.1 * 200 * 0.25 + 1;
  }
  // Now and then one of the two leaves at the bottom and comes back at the top.
  EXPECT_GE(down, 14);
}

// ---- Focus ----

TEST(SceneDefocus, AnEdgeSpreadsByTheDeviation) {
  for (const double deviation : {0.0, 0.8, 1.0, 1.5, 2.5, 4.0, 7.3}) {
    const scene::EffectInfo* info = scene::parse_scene("defocus")[0].info;
    const auto effect = info->make(std::span(&deviation, 1), scene::StreamSource(1, "defocus"));
    constexpr int kSide = 101, kEdge = 50;
    for (const bool upright : {true, false}) {
      scene::FrameState state;
      state.wanted = scene::kFrame | scene::kTruth;
      state.picture = scene::Picture(kSide, kSide);
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
          for (int c = 0; c < 3; ++c)
            state.picture.at(x, y)[c] = (upright ? x : y) > kEdge ? 240 : 0;
      state.truth = scene::Picture(kSide, kSide);
      state.truth.fill(99);
      effect->lens(state);
      for (const uint8_t sample : state.truth.samples) ASSERT_EQ(sample, 99);
      double weight = 0, first = 0, second = 0;
      const auto level = [&](int i) {
        return static_cast<double>(*(upright ? state.picture.at(i, 50) : state.picture.at(50, i)));
      };
      for (int i = 1; i < kSide; ++i) {
        const double step = level(i) - level(i - 1);
        EXPECT_GE(step, 0);
        weight += step, first += step * i, second += step * i * i;
      }
      EXPECT_EQ(weight, 240);
      first /= weight;
      // From the filters' radii the variance comes in steps of 2 (r + 1) / 3, with r <= deviation;
      // three roundings of half a level weigh twice their distance from the edge, as far as the
      // margin.
      const double reach = effect->margin(kSide, kSide);
      const double rounding = 3 * 0.5 / 240 * reach * (reach + 1) * 2;
      const double variance = second / weight - first * first;
      EXPECT_NEAR(variance, deviation * deviation, (deviation + 1) / 3 + rounding) << deviation;
      EXPECT_NEAR(first, kEdge + 1, 0.05 + rounding / 4) << deviation;
    }
  }
}

TEST(SceneDefocus, BlursTheTrueBackgroundAndLabels) {
  Scene blurred(options(96, 72), "defocus=2"), sharp(options(96, 72), "default");
  const Shot soft = shoot(&blurred, 60), hard = shoot(&sharp, 60);
  const auto roughness = [](const std::vector<uint8_t>& samples) {
    double sum = 0;
    for (size_t i = 3; i < samples.size(); ++i) sum += std::abs(samples[i] - samples[i - 3]);
    return sum;
  };
  EXPECT_LT(roughness(soft.background), 0.6 * roughness(hard.background));
  size_t part = 0;
  for (size_t i = 0; i < soft.labels.size(); ++i) {
    part += soft.labels[i] == scene::kPartLabel;
    // Whatever was object is touched still.
    EXPECT_TRUE(!hard.labels[i] || soft.labels[i] != scene::kBackgroundLabel) << i;
  }
  EXPECT_GT(part, 100u);
}

// ---- Codec ----

struct Coded {
  double error = 0, at_blocks = 0, inside = 0;
};

// Mean square error of a compressed frame, and the mean step of the error across columns that begin
// a block of 8 and across others.
Coded coded(const std::string& text) {
  constexpr int kWidth = 160, kHeight = 120;
  Scene scene(options(kWidth, kHeight), text), plain(options(kWidth, kHeight), "default");
  const Shot shot = shoot(&scene, 40), still = shoot(&plain, 40);
  EXPECT_EQ(shot.background, still.background);
  EXPECT_EQ(shot.labels, still.labels);
  const auto error = [&](int x, int y) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
      const auto i = static_cast<size_t>((y * kWidth + x) * 3 + c);
      sum += static_cast<double>(shot.frame[i]) - still.frame[i];
    }
    return sum / 3;
  };
  Coded result;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 1; x < kWidth; ++x) {
      result.error += error(x, y) * error(x, y) / kWidth / kHeight;
      const double step = std::abs(error(x, y) - error(x - 1, y));
      if (x % 8 == 0)
        result.at_blocks += step / (kHeight * (kWidth / 8 - 1));
      else
        result.inside += step / (kHeight * (kWidth - kWidth / 8));
    }
  return result;
}

TEST(SceneCompression, HasBlocksAndLosesMoreAtLowerQuality) {
  double last = 1e9;
  for (const char* quality : {"5", "10", "30", "60", "90", "100"}) {
    const Coded result = coded("compression=" + std::string(quality));
    EXPECT_GT(result.error, 0) << quality;
    EXPECT_LT(result.error, last) << quality;
    last = result.error;
  }
  // Errors of two blocks have nothing to do with each other; inside of one they are smooth waves.
  const Coded coarse = coded("compression=5");
  EXPECT_GT(coarse.at_blocks, 1.5 * coarse.inside);
  // At 100 % next to nothing is left but the coarser colours.
  EXPECT_LT(last, coarse.error / 20);
  EXPECT_EQ(coded("default").error, 0);
}

}  // namespace
}  // namespace qdmd::test
