// SPDX-License-Identifier: LGPL-2.1-or-later
// Text in the picture: what of a mask's changes is taken for it, and a clock in a simulated street.
#include "core/foreground/overlays.h"

#include <algorithm>
#include <functional>
#include <random>
#include <vector>

#include "core/engine/engine.h"
#include "core/scene/scene.h"
#include "gtest/gtest.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 240, kHeight = 120, kSecond = 25;

struct Mask {
  std::vector<uint8_t> samples;
  int width, height;

  explicit Mask(int width_ = kWidth, int height_ = kHeight)
      : samples(static_cast<size_t>(width_) * static_cast<size_t>(height_)),
        width(width_),
        height(height_) {}
  // What of the rectangle is inside becomes white.
  void paint(int x, int y, int wide, int tall) {
    for (int row = std::max(0, y); row < std::min(height, y + tall); ++row)
      for (int col = std::max(0, x); col < std::min(width, x + wide); ++col)
        samples[static_cast<size_t>(row * width + col)] = 255;
  }
  int64_t white(int x, int y, int wide, int tall) const {
    int64_t found = 0;
    for (int row = y; row < y + tall; ++row)
      found += std::count(samples.begin() + row * width + x,
                          samples.begin() + row * width + x + wide, uint8_t{255});
    return found;
  }
};

// A digit of strokes, another one for each value.
void paint_digit(int value, int x, int y, Mask* mask) {
  const int bits[] = {0x3f, 0x06, 0x5b, 0x4f, 0x66, 0x6d, 0x7d, 0x07, 0x7f, 0x6f};
  const int strokes[7][4] = {{0, 0, 10, 3}, {8, 0, 3, 9}, {8, 9, 3, 9}, {0, 15, 10, 3},
                             {0, 9, 3, 9},  {0, 0, 3, 9}, {0, 8, 10, 3}};
  for (int i = 0; i < 7; ++i)
    if (bits[value % 10] >> i & 1)
      mask->paint(x + strokes[i][0], y + strokes[i][1], strokes[i][2], strokes[i][3]);
}

// What is left of a mask's pixels in each of so many frames.
std::vector<double> kept(int frames, const std::function<void(int, Mask*)>& paint) {
  Overlays overlays(kWidth, kHeight);
  std::vector<double> found;
  for (int t = 0; t < frames; ++t) {
    Mask mask;
    paint(t, &mask);
    const auto before = static_cast<double>(mask.white(0, 0, kWidth, kHeight));
    overlays.take_out(mask.samples.data());
    const auto after = static_cast<double>(mask.white(0, 0, kWidth, kHeight));
    found.push_back(before > 0 ? after / before : 1);
  }
  return found;
}

TEST(Overlays, ADigitThatChangesEachSecondIsTextAfterSomeChanges) {
  const std::vector<double> found =
      kept(40 * kSecond, [](int t, Mask* mask) { paint_digit(t / kSecond, 203, 11, mask); });
  // That it came is the first change. Nothing is known before the sixth one has rested.
  const auto first = found.begin() + 5 * kSecond + 6;
  EXPECT_EQ(5 * kSecond + 6, std::count(found.begin(), first, 1.0));
  EXPECT_EQ(0.0, *std::max_element(found.begin() + 25 * kSecond, found.end()));
}

TEST(Overlays, MinutesBelongToSecondsThatAreText) {
  const std::vector<double> found = kept(150 * kSecond, [](int t, Mask* mask) {
    const int seconds = t / kSecond;
    paint_digit(seconds % 10, 203, 11, mask);
    if (seconds >= 60) paint_digit(seconds / 60, 163, 11, mask);
  });
  for (int t = 60 * kSecond; t < 150 * kSecond; ++t)
    EXPECT_EQ(0.0, found[static_cast<size_t>(t)]) << t;
}

TEST(Overlays, WhatMovesIsNone) {
  // People, cars of all lengths and speeds; one after another, for minutes.
  std::mt19937 rng(661);
  int x = kWidth, wide = 0, speed = 1, top = 0;
  const std::vector<double> found = kept(6000, [&](int, Mask* mask) {
    if (x >= kWidth) {
      wide = std::uniform_int_distribution(6, 200)(rng),
      speed = std::uniform_int_distribution(1, 14)(rng);
      top = std::uniform_int_distribution(20, 60)(rng);
      x = -wide;
    }
    x += speed;
    mask->paint(x, top, wide, 40);
  });
  EXPECT_EQ(1.0, *std::min_element(found.begin(), found.end()));
}

TEST(Overlays, WhoStandsIsNone) {
  // He comes, stands, and now and then lifts an arm.
  const std::vector<double> found = kept(4000, [&](int t, Mask* mask) {
    const int x = std::min(t, 100), since = t % 60;
    mask->paint(x, 30, 24, 70);
    if (t > 100 && since < 16) mask->paint(x + 24, 40 + since, 2 * std::min(since, 16 - since), 5);
  });
  EXPECT_EQ(1.0, *std::min_element(found.begin(), found.end()));
}

TEST(Overlays, KeyFramesOfACodecAreNone) {
  // Each half second what is white changes at once: a part of it, or all of the picture.
  for (const bool all : {false, true}) {
    const std::vector<double> found = kept(4000, [&](int t, Mask* mask) {
      const int turn = t / 12 % 2;
      mask->paint(100, 30, 40, 70);
      for (int y = 30; !all && y < 100; y += 8)
        if (turn) mask->paint(99, y, 1, 8);
      for (int y = 0; all && y < kHeight; y += 8)
        for (int x = 0; x < kWidth; x += 8)
          if (turn) mask->paint(x, y, 4, 8);
    });
    EXPECT_EQ(1.0, *std::min_element(found.begin(), found.end())) << all;
  }
}

TEST(Overlays, WhatPassesNextToTextIsSeenAndForgettingForgets) {
  Overlays overlays(kWidth, kHeight);
  const auto frame = [&](int t, int x) {
    Mask mask;
    paint_digit(t / kSecond, 203, 11, &mask);
    mask.paint(x, 60, 20, 50);
    overlays.take_out(mask.samples.data());
    return mask;
  };
  for (int t = 0; t < 600; ++t) frame(t, -100);
  for (int t = 600; t < 700; ++t) {
    const Mask mask = frame(t, 2 * (t - 600));
    EXPECT_EQ(0, mask.white(195, 4, 30, 30)) << t;
    EXPECT_EQ(20 * 50, mask.white(2 * (t - 600), 60, 20, 50)) << t;
  }
  overlays.forget();
  const Mask mask = frame(700, -100);
  EXPECT_LT(0, mask.white(195, 4, 30, 30));
}

TEST(Overlays, AnySizeIsOrdinary) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 9}, {8, 8}, {33, 17}}) {
    Overlays overlays(width, height);
    for (int t = 0; t < 200; ++t) {
      Mask mask(width, height);
      if (t / 20 % 2) mask.paint(0, 0, width, height);
      overlays.take_out(mask.samples.data());
    }
  }
}

// ---- A clock ----

TEST(Overlays, AreAClockInAStreet) {
  constexpr int kWide = 320, kTall = 240, kFrames = 450;
  constexpr size_t kFirst = 250;
  scene::SceneOptions scene_options;
  scene_options.seed = 9;
  scene::Scene scene(scene_options, "noise,clock=0.1");
  std::vector<std::vector<uint8_t>> frames, labels;
  for (int t = 0; t < kFrames; ++t) {
    scene.render(t, scene::kFrame | scene::kLabels);
    frames.push_back(scene.frame().samples);
    labels.push_back(scene.labels().samples);
  }
  for (const Mode mode : {Mode::batch, Mode::live})
    for (const bool leaves_out : {true, false}) {
      EngineOptions options;
      options.mode = mode;
      options.steps.overlays = leaves_out;
      Engine engine;
      ASSERT_TRUE(engine.configure(options, kWide, kTall).ok());
      std::vector<uint8_t> mask(size_t{kWide} * kTall * 3);
      const auto view_of = [](auto* rgb) {
        BasicImageView<std::remove_pointer_t<decltype(rgb)>> view;
        for (int c = 0; c < 3; ++c) view.channel[c] = rgb + c;
        view.width = kWide, view.height = kTall;
        view.pixel_stride = 3, view.row_stride = 3 * kWide;
        return view;
      };
      size_t popped = 0;
      int text = 0;
      double hits = 0, people = 0;
      const auto pop = [&] {
        for (; engine.next(); ++popped) {
          engine.next()->pop(Output::mask, view_of(mask.data()));
          if (popped < kFirst) continue;
          int false_white = 0;
          for (size_t p = 0; p < mask.size() / 3; ++p) {
            const bool person = labels[popped][p] == scene::kObjectLabel;
            hits += mask[3 * p] == 255 && person;
            people += person;
            false_white += mask[3 * p] == 255 && !person && p < size_t{kWide} * kTall / 6;
          }
          text += false_white > 8;
        }
      };
      for (const std::vector<uint8_t>& frame : frames) {
        ASSERT_TRUE(engine.push(view_of(frame.data())).ok());
        pop();
      }
      ASSERT_TRUE(engine.drain().ok());
      pop();
      // Without the step text is white in most frames; nobody else loses by it.
      const auto counted = static_cast<int>(kFrames - kFirst);
      if (leaves_out) {
        EXPECT_LE(text, counted / 50);
      } else {
        EXPECT_GT(text, counted / 2);
      }
      EXPECT_GT(hits / people, 0.9);
    }
}

}  // namespace
}  // namespace qdmd::test
