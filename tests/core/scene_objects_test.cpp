// SPDX-License-Identifier: LGPL-2.1-or-later
// Effects on objects, background and shutter: who is where when, and what is seen of it.
#include <algorithm>
#include <limits>

#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Box;
using scene::Scene;

size_t count(const std::vector<uint8_t>& labels, uint8_t label) {
  return static_cast<size_t>(std::count(labels.begin(), labels.end(), label));
}

// ---- Movers ----

TEST(SceneStop, StandsExactlyAsLongAsAsked) {
  for (const double seconds : {0.0, 1.0, 8.0}) {
    constexpr int kRate = 25;
    Scene scene(options(320, 240, kRate), "stop=" + std::to_string(seconds));
    // It goes 4 pixels a frame but for the time that it stands.
    constexpr double kHalf = scene::Crossing::kCrossing / 2;
    int standing = 0;
    const auto middle = static_cast<int64_t>(std::ceil((kHalf + seconds / 2) * kRate));
    const Shot there = shoot(&scene, middle);
    ASSERT_EQ(there.boxes.size(), 1u);
    const auto last = static_cast<int64_t>((2 * kHalf + seconds) * kRate);
    for (int64_t k = 0; k < last; ++k) {
      const Shot shot = shoot(&scene, k);
      const double time = static_cast<double>(k) / kRate;
      const bool same = shot == there, stands = time >= kHalf && time <= kHalf + seconds;
      standing += same;
      EXPECT_EQ(same, stands || (seconds == 0 && k == middle)) << seconds << " s, frame " << k;
    }
    EXPECT_EQ(standing, std::max(1.0, seconds * kRate));
    // It then goes the other half, and is gone at the end: 16 pixels beyond the frame.
    EXPECT_EQ(shoot(&scene, last - 9).boxes.size(), 1u);
    EXPECT_EQ(count(shoot(&scene, last).labels, scene::kObjectLabel), 0u);
  }
}

TEST(SceneAbandon, TheBagIsForegroundAndNeverBackground) {
  Scene with(options(160, 120), "abandon=2:seconds=4"), plain(options(160, 120), "default");
  for (int64_t k = 0; k < 200; ++k) {
    const Shot bag = shoot(&with, k), none = shoot(&plain, k);
    EXPECT_EQ(bag.background, none.background);
    // From 2 s until 6 s at 25 frames a second.
    const bool there = k >= 50 && k < 150;
    EXPECT_EQ(bag.boxes.size(), none.boxes.size() + there) << k;
    if (!there) {
      EXPECT_TRUE(bag == none) << k;
      continue;
    }
    EXPECT_GE(count(bag.labels, scene::kObjectLabel), count(none.labels, scene::kObjectLabel));
    EXPECT_NE(bag.frame, none.frame) << k;
  }
}

TEST(SceneRemove, TheVanIsBackgroundUntilItDrivesOff) {
  Scene with(options(160, 120), "remove=3"), plain(options(160, 120), "default");
  const Shot parked = shoot(&with, 0);
  int driving = 0;
  bool gone = false;
  for (int64_t k = 0; k < 300; ++k) {
    const Shot van = shoot(&with, k), none = shoot(&plain, k);
    if (k < 75) {
      EXPECT_EQ(van.background, parked.background) << k;
      EXPECT_NE(van.background, none.background) << k;
      EXPECT_EQ(van.labels, none.labels) << k;
      EXPECT_EQ(van.boxes, none.boxes) << k;
      continue;
    }
    EXPECT_EQ(van.background, none.background) << k;
    const bool seen = van.boxes.size() > none.boxes.size();
    EXPECT_FALSE(seen && gone) << k;
    gone = !seen;
    driving += seen;
    if (seen)
      EXPECT_NE(van.labels, none.labels) << k;
    else
      EXPECT_TRUE(van == none) << k;
  }
  // It has 75 to 95 % of the width to go at 0.12 widths/s^2, as far as 3.5 to 4 s.
  EXPECT_GE(driving, 25 * 3.5 - 1);
  EXPECT_LE(driving, 25 * 4.0 + 1);
  EXPECT_TRUE(gone);
}

// The shutter is open before the van drives off and after: what it sees of the van while that still
// belongs to the background is painted nowhere, so that the van is half transparent.
TEST(SceneRemove, TheVanIsOpaqueWhenItStartsInFrontOfASlowShutter) {
  Scene blurred(options(160, 120), "remove=3,motion-blur"), sharp(options(160, 120), "remove=3"),
      plain(options(160, 120), "default");
  // In the first 10 ms the van goes 6e-6 widths: it stands still for every sample of the shutter.
  const Shot a = shoot(&blurred, 75), b = shoot(&sharp, 75), none = shoot(&plain, 75);
  size_t van = 0, unlike = 0;
  for (size_t i = 0; i < b.labels.size(); ++i) {
    if (b.labels[i] == 0 || none.labels[i] != 0) continue;
    ++van;
    unlike += !std::equal(&a.frame[3 * i], &a.frame[3 * i] + 3, &b.frame[3 * i]);
  }
  ASSERT_GT(van, 500u);
  // The mover passes in front of a part of it.
  EXPECT_LT(unlike, van / 4);
}

TEST(SceneBootstrap, NoFrameIsWithoutForeground) {
  for (const auto& [width, height] : {std::pair{2, 2}, {17, 9}, {64, 48}, {20, 90}})
    for (const char* name : {"bootstrap=1", "bootstrap"})
      for (uint64_t seed = 0; seed < 4; ++seed) {
        Scene scene(options(width, height, 2, seed), name);
        for (int64_t k = 0; k < 300; ++k)
          ASSERT_GT(count(shoot(&scene, k, scene::kLabels).labels, scene::kObjectLabel), 0u)
              << name << ' ' << width << 'x' << height << " frame " << k;
      }
}

// Feet are counted from 0.66 to 0.90 of one row, which is row 0: figures stand above the frame.
TEST(SceneBootstrap, NoFrameOfOneRowIsWithoutForeground) {
  Scene scene(options(32, 1, 2), "bootstrap");
  for (int64_t k = 0; k < 100; ++k)
    ASSERT_GT(count(shoot(&scene, k, scene::kLabels).labels, scene::kObjectLabel), 0u) << k;
}

// Mean and standard error of a series, from the means of 40 blocks.
std::pair<double, double> block_mean(const std::vector<double>& series) {
  constexpr size_t kBlocks = 40;
  const size_t length = series.size() / kBlocks;
  double sum = 0, squares = 0;
  for (size_t block = 0; block < kBlocks; ++block) {
    double part = 0;
    for (size_t i = 0; i < length; ++i) part += series[block * length + i];
    part /= static_cast<double>(length);
    sum += part, squares += part * part;
  }
  const double average = sum / kBlocks;
  return {average, std::sqrt((squares / kBlocks - average * average) / (kBlocks - 1))};
}

TEST(SceneClutter, CoversEachPixelForItsShareOfTheTime) {
  constexpr int kWidth = 64, kHeight = 48;
  for (const double share : {0.2, 0.6, 0.95}) {
    // A frame every 1.37 s of traffic that goes on by 0.237 widths a second.
    const std::string text = "low-rate=0.73,clutter=" + std::to_string(share) + ":speed=0.237";
    Scene scene(options(kWidth, kHeight), text), mover(options(kWidth, kHeight), "low-rate=0.73");
    for (const auto& [x, y] : {std::pair{0, 22}, {63, 22}, {31, 22}, {20, 42}, {50, 30}}) {
      // What the mover hides says nothing about lorries, whose stream is another one.
      std::vector<double> covered;
      for (int64_t k = 0; k < 4000; ++k) {
        const auto i = static_cast<size_t>(y * kWidth + x);
        mover.render(k, scene::kLabels);
        if (mover.labels().samples[i] != 0) continue;
        scene.render(k, scene::kLabels);
        covered.push_back(scene.labels().samples[i] == scene::kObjectLabel);
      }
      const auto [measured, error] = block_mean(covered);
      EXPECT_LT(error, 0.02) << text;
      // 4 sigma.
      EXPECT_NEAR(measured, share, 4 * error) << text << " at " << x << ", " << y;
    }
    // Rows outside of the band, 45 to 90 %, are as in the scene without.
    for (int64_t k = 0; k < 50; ++k) {
      const Shot with = shoot(&scene, k), without = shoot(&mover, k);
      EXPECT_TRUE(std::equal(with.frame.begin(), with.frame.begin() + 22 * kWidth * 3,
                             without.frame.begin()));
      EXPECT_TRUE(std::equal(with.labels.begin() + 43 * kWidth, with.labels.end(),
                             without.labels.begin() + 43 * kWidth));
    }
  }
}

// Lorries are gone once their slot begins right of the frame, though a camera that looks beside its
// place still sees them there.
TEST(SceneClutter, CoversItsShareForAShakingCameraToo) {
  Scene scene(options(64, 48), "low-rate=0.73,clutter=0.95:speed=0.237,jitter=8");
  std::vector<double> covered;
  for (int64_t k = 0; k < 6000; ++k) {
    scene.render(k, scene::kLabels);
    if (scene.shift_x() > 8 && std::abs(scene.shift_y()) < 5)
      covered.push_back(scene.labels().at(63, 30)[0] != 0);
  }
  ASSERT_GT(covered.size(), 400u);
  const auto [measured, error] = block_mean(covered);
  // The mover may cover more. 4 sigma.
  EXPECT_GT(measured, 0.95 - 4 * error);
}

TEST(SceneCamouflage, ObjectsAreLighterByTheContrast) {
  constexpr int kWidth = 160, kHeight = 120;
  // The rows a mover walks in: from the top of the farthest one to the feet of the nearest.
  constexpr int kTop = 81 - 50, kBottom = 110;
  for (const double contrast : {0.0, 10.0, 40.0}) {
    Scene scene(options(kWidth, kHeight), "camouflage=" + std::to_string(contrast));
    int seen = 0;
    for (int64_t k = 20; k < 500; k += 10) {
      const Shot shot = shoot(&scene, k);
      if (shot.boxes.size() != 1 || shot.boxes[0].x == 0 || shot.boxes[0].right() == kWidth)
        continue;
      ++seen;
      for (size_t c = 0; c < 3; ++c) {
        double around = 0, object = 0, pixels = 0;
        for (size_t i = 0; i < shot.labels.size(); ++i) {
          const auto row = static_cast<int>(i) / kWidth;
          if (row >= kTop && row < kBottom) around += shot.background[3 * i + c];
          if (shot.labels[i] == scene::kObjectLabel) object += shot.frame[3 * i + c], ++pixels;
        }
        around /= kWidth * (kBottom - kTop);
        // Levels are rounded, each by half a level at most.
        EXPECT_NEAR(object / pixels - around, contrast, 0.5) << k << " channel " << c;
      }
    }
    EXPECT_GT(seen, 10);
  }
}

TEST(SceneLowRate, TimeGoesOnByItsOwnClock) {
  for (const auto& [rate, text] : {std::pair{2.0, "low-rate=2"}, {0.3, "low-rate=0.3"}}) {
    Scene slow(options(80, 60, 25), text), plain(options(80, 60, rate), "default");
    for (int64_t k = 0; k < 60; ++k) EXPECT_TRUE(shoot(&slow, k) == shoot(&plain, k)) << k;
  }
  // The scene does not go on faster with the video's rate.
  Scene slow(options(80, 60, 25), "low-rate,leaves,fade"),
      fast(options(80, 60, 60), "low-rate,leaves,fade");
  for (int64_t k = 0; k < 20; ++k) EXPECT_TRUE(shoot(&slow, k) == shoot(&fast, k)) << k;
}

// ---- Shadow ----

TEST(SceneShadow, DarkensTheGroundOnceAndSaysWhere) {
  for (const auto& [depth, blue] : {std::pair{0.0, 0.0}, {0.45, 0.0}, {1.0, 0.0}, {0.8, 0.3}}) {
    std::string text = "shadow=" + std::to_string(depth) + ":length=1.5";
    if (blue > 0) text += ":blue=" + std::to_string(blue);
    // Persons whose shadows overlap.
    Scene with(options(160, 120, 5), text + ",bootstrap=12"),
        without(options(160, 120, 5), "bootstrap=12");
    size_t dark = 0, overlaps = 0;
    for (int64_t k = 0; k < 60; ++k) {
      const Shot shadow = shoot(&with, k), plain = shoot(&without, k);
      EXPECT_EQ(shadow.boxes, plain.boxes);
      EXPECT_EQ(shadow.background, plain.background);
      size_t in_frame = 0;
      for (size_t i = 0; i < shadow.labels.size(); ++i) {
        if (shadow.labels[i] != scene::kShadowLabel) {
          ASSERT_EQ(shadow.labels[i], plain.labels[i]);
          continue;
        }
        ++in_frame;
        ASSERT_EQ(plain.labels[i], scene::kBackgroundLabel);
        for (size_t c = 0; c < 3; ++c) {
          const double taken = depth * (1 - blue * static_cast<double>(c) / 2);
          const double expected = shadow.background[3 * i + c] * (1 - taken);
          ASSERT_NEAR(shadow.frame[3 * i + c], expected, 0.5 + 1e-9) << text;
        }
      }
      dark += in_frame;
      overlaps += in_frame > 0;
    }
    EXPECT_GT(dark, 50000u) << text;
    EXPECT_EQ(overlaps, 60u) << text;
  }
}

TEST(SceneShadow, StandsAtTheFeetAndFallsToTheRight) {
  Scene scene(options(160, 120), "shadow:length=1");
  int seen = 0;
  for (int64_t k = 30; k < 95; k += 5) {
    const Shot shot = shoot(&scene, k);
    if (shot.boxes.size() != 1 || shot.boxes[0].right() > 100) continue;
    ++seen;
    const Box& box = shot.boxes[0];
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x)
        if (shot.labels[static_cast<size_t>(y * 160 + x)] == scene::kShadowLabel) {
          // As far as the object is high, and 0.35 of it up the picture.
          EXPECT_GE(x, box.x);
          EXPECT_LE(x, box.right() + box.height + 1);
          EXPECT_LT(y, box.bottom());
          EXPECT_GE(y, box.bottom() - std::ceil(0.35 * (box.height + 1)) - 1);
        }
  }
  EXPECT_GT(seen, 2);
}

// ---- Shutter ----

TEST(SceneMotionBlur, IsTheMeanOfWhatTheShutterSees) {
  // Eight samples over half of 1/25 s: of a video of 800 frames a second every second one.
  Scene blurred(options(160, 120, 25), "motion-blur=0.5"), fast(options(160, 120, 800), "default");
  size_t part = 0;
  for (int64_t k = 3; k < 120; k += 9) {
    const Shot shot = shoot(&blurred, k);
    std::vector<int> sums(shot.frame.size()), covered(shot.labels.size());
    for (int64_t i = 0; i < 8; ++i) {
      const Shot sample = shoot(&fast, 32 * k + 2 * i - 7);
      for (size_t p = 0; p < sums.size(); ++p) sums[p] += sample.frame[p];
      for (size_t p = 0; p < covered.size(); ++p) covered[p] += sample.labels[p] != 0;
      EXPECT_EQ(sample.background, shot.background);
    }
    for (size_t p = 0; p < sums.size(); ++p) ASSERT_EQ(shot.frame[p], (sums[p] + 4) / 8) << k;
    for (size_t p = 0; p < covered.size(); ++p) {
      const int label = covered[p] == 0  ? scene::kBackgroundLabel
                        : covered[p] < 4 ? scene::kPartLabel
                                         : scene::kObjectLabel;
      ASSERT_EQ(shot.labels[p], label) << k;
      part += label == scene::kPartLabel;
    }
  }
  EXPECT_GT(part, 100u);
}

// ---- Moving background ----

// The pixels of which one changes between any of some frames, as a box.
Box changed(const char* text, int frames) {
  constexpr int kWidth = 160, kHeight = 120;
  Scene scene(options(kWidth, kHeight), text), still(options(kWidth, kHeight), "default");
  const Shot plain = shoot(&still, 0);
  int left = kWidth, right = 0, top = kHeight, bottom = 0;
  for (int64_t k = 0; k < frames; ++k) {
    const Shot shot = shoot(&scene, k, scene::kTruth);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto at = static_cast<size_t>(y * kWidth + x) * 3;
        if (std::equal(&shot.background[at], &shot.background[at] + 3, &plain.background[at]))
          continue;
        left = std::min(left, x), right = std::max(right, x + 1);
        top = std::min(top, y), bottom = std::max(bottom, y + 1);
      }
  }
  return {left, top, right - left, bottom - top};
}

TEST(SceneBackgroundMotion, StaysInItsRegion) {
  const scene::Backdrop backdrop(160, 120, 0, scene::StreamSource(7, "backdrop"));
  const Box crown = changed("leaves=4", 40), canal = changed("water", 20),
            screen = changed("flicker", 10);
  EXPECT_EQ(scene::intersection(crown, backdrop.tree_crown()), crown);
  EXPECT_EQ(canal, backdrop.canal());
  EXPECT_EQ(screen, backdrop.shop_window());
  // The crown is an ellipse in its box: nearly all of both sides.
  EXPECT_GE(crown.width, backdrop.tree_crown().width * 9 / 10);
  EXPECT_GE(crown.height, backdrop.tree_crown().height * 9 / 10);
}

TEST(SceneFlicker, BrightnessHasItsDeviation) {
  constexpr int kFrames = 2000;
  for (const double amplitude : {5.0, 15.0}) {
    Scene scene(options(40, 30), "flicker=" + std::to_string(amplitude));
    const scene::Backdrop backdrop(40, 30, 0, scene::StreamSource(7, "backdrop"));
    const Box& window = backdrop.shop_window();
    ASSERT_FALSE(window.empty());
    double sum = 0, squares = 0, products = 0, last = 0;
    for (int64_t k = 0; k < kFrames; ++k) {
      scene.render(k, scene::kTruth);
      const double level = scene.background().at(window.x, window.y)[0] -
                           backdrop.picture().at(window.x, window.y)[0];
      sum += level, squares += level * level, products += level * last;
      last = level;
    }
    // A uniform number, kurtosis 1.8, and rounding; no frame knows of the last. 4.5 sigma.
    const double variance = amplitude * amplitude + 1 / 12.0;
    EXPECT_NEAR(sum / kFrames, 0, 4.5 * std::sqrt(variance / kFrames));
    EXPECT_NEAR(squares / kFrames, variance, 4.5 * variance * std::sqrt(0.8 / kFrames));
    EXPECT_NEAR(products / kFrames, 0, 4.5 * variance / std::sqrt(kFrames));
  }
}

}  // namespace
}  // namespace qdmd::test
