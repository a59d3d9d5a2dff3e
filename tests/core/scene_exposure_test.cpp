// SPDX-License-Identifier: LGPL-2.1-or-later
// What a camera makes of light: its curve, white that clips, exposure that hunts, colour that goes;
// and light that falls on a part of the picture.
#include <algorithm>
#include <numbers>

#include "core/scene/paint.h"
#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

constexpr int kWidth = 64, kHeight = 48;

// The gain of frames at a time, of a scene of 100 frames/s, where light does not change before 3 s.
double gain_at(const std::string& text, double time) {
  Scene scene(options(kWidth, kHeight, 100), text);
  scene.render(std::lround(time * 100), scene::kBoxes);
  return scene.light().gain[1];
}

// How much of a step of light a camera has taken in after `seconds`: the metered mean over the
// step.
double followed(const std::string& camera, double seconds) {
  const std::string step = "fade=0.4:duration=0.001:from=20,";
  const double time = 20 + seconds;
  const double metered = 0.6 * gain_at(camera, time) / gain_at(step + camera, time);
  return (1 - metered) / 0.4;
}

// ---- Exposure ----

TEST(SceneExposure, ItsCurveIsThatOfTheLight) {
  for (const double gamma : {1.0, 2.2, 2.4})
    for (const double light : {0.3, 0.8, 1.0, 1.5}) {
      const std::string camera = ",exposure=0:gamma=" + std::to_string(gamma);
      Scene lit(options(kWidth, kHeight), "fade=" + std::to_string(1 - light) + camera),
          plain(options(kWidth, kHeight), "default");
      const Shot seen = shoot(&lit, 300), day = shoot(&plain, 300);
      EXPECT_NEAR(seen.gain[0], light, 1e-9);
      const double black = scene::black_of_curve(gamma);
      for (size_t i = 0; i < day.frame.size(); ++i) {
        // Decoded, lit, encoded.
        const double linear = std::pow((day.frame[i] + black) / (255 + black), gamma) * light;
        const double expected =
            std::clamp(std::pow(linear, 1 / gamma) * (255 + black) - black, 0.0, 255.0);
        ASSERT_NEAR(seen.frame[i], expected, 0.5 + 1e-6) << gamma << ' ' << light;
      }
    }
  // sRGB's curve at 2.4, above the light in which it is a line.
  EXPECT_NEAR(scene::black_of_curve(2.4), 0.055 * 255, 1e-9);
}

TEST(SceneExposure, WhatIsBrighterThanWhiteIsClipped) {
  Scene bright(options(kWidth, kHeight), "exposure=0:brightness=2"),
      plain(options(kWidth, kHeight), "default");
  const Shot seen = shoot(&bright, 30), day = shoot(&plain, 30);
  size_t white = 0;
  for (size_t i = 0; i < day.frame.size(); ++i) {
    ASSERT_EQ(seen.frame[i], std::min(255, 2 * day.frame[i]));
    ASSERT_EQ(seen.background[i], std::min(255, 2 * day.background[i]));
    white += seen.frame[i] == 255;
  }
  EXPECT_GT(white, day.frame.size() / 10);
}

TEST(SceneExposure, BeginsToFollowAfterItsDelay) {
  EXPECT_NEAR(followed("exposure=1:lag=0.5:delay=1", 0.98), 0, 1e-9);
  EXPECT_GT(followed("exposure=1:lag=0.5:delay=1", 1.02), 0.05);
  // As without, a second later: the mover, 7 % of the picture, weighs what it covers a little
  // differently at another time.
  for (const double seconds : {0.5, 1.0, 2.0})
    EXPECT_NEAR(followed("exposure=1:lag=0.5:delay=1", seconds + 1),
                followed("exposure=1:lag=0.5", seconds), 0.04);
}

TEST(SceneExposure, GoesTooFarByItsOvershoot) {
  for (const double overshoot : {0.1, 0.3}) {
    const std::string camera = "exposure=1:lag=1:overshoot=" + std::to_string(overshoot);
    // The peak of a damped swing: half of its period.
    const double w = std::numbers::pi / -std::log(overshoot), peak = std::numbers::pi / w;
    double most = 0;
    for (double seconds = 0; seconds < 5; seconds += 0.05)
      most = std::max(most, followed(camera, seconds));
    // The past is seen in steps of a tenth of a lag, and the mover weighs 4 %.
    EXPECT_NEAR(most, 1 + overshoot, 0.06);
    EXPECT_NEAR(followed(camera, peak), 1 + overshoot, 0.06);
    EXPECT_NEAR(followed(camera, 5.5), 1, 0.02);
    // A swing begins slower than what follows at once.
    EXPECT_LT(followed(camera, 0.2), followed("exposure=1:lag=1", 0.2));
  }
  for (double seconds = 0; seconds < 6; seconds += 0.25)
    EXPECT_LE(followed("exposure=1", seconds), 1 + 0.02);
}

TEST(SceneExposure, HuntsInItsPeriod) {
  for (const double time : {0.0, 0.5, 1.0, 2.5, 7.0})
    EXPECT_NEAR(gain_at("exposure=0:swing=0.2:period=2.5:brightness=1.5", time),
                1.5 * (1 + 0.2 * std::sin(2 * std::numbers::pi * time / 2.5)), 1e-9);
}

// ---- Infra-red ----

TEST(SceneInfrared, ColourGoesAndComesBack) {
  const auto how = options(kWidth, kHeight);
  Scene night(how, "infrared=1.2:from=1:seconds=2"), noisy(how, "noise,infrared=1.2:from=1"),
      plain(how, "default");
  for (const int64_t k : {0, 24, 25, 60, 74, 75, 200}) {
    const Shot seen = shoot(&night, k), day = shoot(&plain, k);
    EXPECT_EQ(seen.labels, day.labels);
    if (k < 25 || k >= 75) {
      EXPECT_TRUE(seen == day) << k;
      continue;
    }
    const auto expect_grey = [](const std::vector<uint8_t>& grey, const std::vector<uint8_t>& rgb) {
      for (size_t i = 0; i < rgb.size(); i += 3) {
        const double luma = 0.299 * rgb[i] + 0.587 * rgb[i + 1] + 0.114 * rgb[i + 2];
        for (size_t c = 0; c < 3; ++c)
          ASSERT_NEAR(grey[i + c], std::min(255.0, 1.2 * luma), 0.5 + 1e-6);
      }
    };
    expect_grey(seen.frame, day.frame);
    expect_grey(seen.background, day.background);
    // The noise has no colour either.
    const Shot noise = shoot(&noisy, k);
    for (size_t i = 0; i < noise.frame.size(); i += 3)
      ASSERT_TRUE(noise.frame[i] == noise.frame[i + 1] && noise.frame[i] == noise.frame[i + 2]);
    EXPECT_NE(noise.frame, seen.frame);
  }
}

// ---- Light on a part of the picture ----

// The factor of a place's light in a frame: of its brightest channel that is not clipped.
double factor_at(const Shot& lit, const Shot& plain, int x, int y, int width) {
  const auto at = static_cast<size_t>(y * width + x) * 3;
  double best = 0, factor = 0;
  for (size_t c = 0; c < 3; ++c)
    if (lit.background[at + c] < 255 && plain.background[at + c] > best) {
      best = plain.background[at + c];
      factor = lit.background[at + c] / best;
    }
  return factor;
}

TEST(SceneLocalLight, IsTrueAndEvenOutsideOfIt) {
  for (const std::string name : {"lamp", "headlights", "cloud"}) {
    Scene lit(options(160, 120), name), plain(options(160, 120), "default");
    for (const int64_t k : {0, 40, 75, 110, 160, 220}) {
      const Shot seen = shoot(&lit, k), day = shoot(&plain, k);
      EXPECT_EQ(seen.labels, day.labels) << name;
      EXPECT_EQ(seen.boxes, day.boxes) << name;
      // What is not in it is as it was: the lower right corner never is.
      EXPECT_TRUE(std::equal(seen.frame.end() - 10, seen.frame.end(), day.frame.end() - 10))
          << name << ' ' << k;
      for (size_t i = 0; i < seen.labels.size(); ++i)
        if (seen.labels[i] == 0) {
          ASSERT_TRUE(
              std::equal(&seen.frame[3 * i], &seen.frame[3 * i] + 3, &seen.background[3 * i]));
        }
    }
  }
}

TEST(SceneLamp, LightsItsCornerWhileItIsOn) {
  Scene lit(options(160, 120), "lamp=0.5:x=0.25:y=0.5:radius=0.5:from=1:seconds=1:every=2"),
      plain(options(160, 120), "default");
  for (const int64_t k : {0, 24, 25, 49, 50, 74, 75, 99, 100}) {
    const Shot seen = shoot(&lit, k), day = shoot(&plain, k);
    if (k / 25 % 2 == 0) {
      EXPECT_TRUE(seen == day) << k;
      continue;
    }
    // Levels round by a half; the middle, half of the way out, and beyond it.
    EXPECT_NEAR(factor_at(seen, day, 40, 60, 160), 1.5, 0.02) << k;
    EXPECT_NEAR(factor_at(seen, day, 70, 60, 160), 1.25, 0.02) << k;
    EXPECT_EQ(factor_at(seen, day, 101, 60, 160), 1) << k;
  }
}

TEST(SceneHeadlights, SweepFromSideToSide) {
  Scene lit(options(160, 120), "headlights=1:from=1:seconds=2:every=4"),
      plain(options(160, 120), "default");
  double last = -1;
  for (int64_t k = 30; k < 70; k += 5) {
    const Shot seen = shoot(&lit, k), day = shoot(&plain, k);
    double sum = 0, weight = 0;
    for (int x = 0; x < 160; ++x) {
      const double more = std::max(0.0, factor_at(seen, day, x, 100, 160) - 1);
      sum += more * x, weight += more;
    }
    ASSERT_GT(weight, 1) << k;
    EXPECT_GT(sum / weight, last) << k;
    last = sum / weight;
  }
  EXPECT_TRUE(shoot(&lit, 80) == shoot(&plain, 80));
}

TEST(SceneCloud, ComesOverItsShareAndGoes) {
  Scene lit(options(160, 120), "cloud=0.4:share=0.5:edge=0.1:way=1:from=1:seconds=4"),
      plain(options(160, 120), "default");
  for (const int64_t k : {60, 75, 95}) {
    const Shot seen = shoot(&lit, k), day = shoot(&plain, k);
    // Half of the width, and 5 % more, of which 10 % fade.
    for (const int y : {2, 60, 117}) {
      EXPECT_NEAR(factor_at(seen, day, 60, y, 160), 0.6, 0.02) << k;
      EXPECT_NEAR(factor_at(seen, day, 80, y, 160), 0.8, 0.05) << k;
      EXPECT_EQ(factor_at(seen, day, 95, y, 160), 1) << k;
    }
  }
  EXPECT_TRUE(shoot(&lit, 24) == shoot(&plain, 24));
  EXPECT_TRUE(shoot(&lit, 126) == shoot(&plain, 126));
}

TEST(SceneExposure, MetersLightOnAPartOfThePicture) {
  // A cloud over all of the picture is a fade; over half of it, half of that.
  const std::string camera = ",exposure=1:lag=0.01";
  const double all =
      gain_at("cloud=0.4:share=1:way=0.1:from=1" + camera, 4) / gain_at("exposure=1:lag=0.01", 4);
  EXPECT_NEAR(all, 1 / 0.6, 0.02);
  const double half =
      gain_at("cloud=0.4:share=0.5:way=0.1:from=1" + camera, 4) / gain_at("exposure=1:lag=0.01", 4);
  EXPECT_NEAR(half, 1 / 0.8, 0.03);
}

}  // namespace
}  // namespace qdmd::test
