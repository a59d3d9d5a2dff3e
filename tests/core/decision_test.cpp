// SPDX-License-Identifier: LGPL-2.1-or-later
// Masks: what they make of light, of textures that move, of lamps, and of pictures in which there
// is little to see.
#include "core/foreground/decision.h"

#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

// ---- Decisions ----

// Planes of a picture.
struct Planes {
  int width, height;
  std::vector<uint8_t> level[3];

  Planes(int w, int h) : width(w), height(h) {
    for (auto& plane : level) plane.resize(static_cast<size_t>(w) * static_cast<size_t>(h));
  }
  size_t pixels() const { return level[0].size(); }
  uint8_t& at(int c, int x, int y) {
    return level[c][static_cast<size_t>(std::clamp(y, 0, height - 1) * width +
                                        std::clamp(x, 0, width - 1))];
  }
};

// What a model makes of one picture, for ever.
BackgroundModel model_of(const Planes& background, uint8_t limit = 12) {
  BackgroundModel model;
  const std::vector<uint8_t> limits(background.pixels(), limit);
  model.make_room(background.pixels(), true);
  model.freeze_as({8, {background.level[0], background.level[1], background.level[2]}, {}}, &limits,
                  background.pixels());
  model.set_time(0);
  return model;
}

struct Decided {
  Decided(const Planes& background, const DecisionSteps& steps = {}, Colours colours = Colours::rgb,
          const Levels& levels = {}, uint8_t limit = 12)
      : model(model_of(background, limit)),
        decision(background.width, background.height, colours, steps, levels) {}
  const uint8_t* operator()(const Planes& frame, Pool* pool = nullptr) {
    Comparison all = {{frame.level[0].data(), frame.level[1].data(), frame.level[2].data()},
                      &model,
                      threshold,
                      limits ? model.limits() : nullptr};
    all.shadows = shadows;
    decision.decide(all, pool);
    return decision.mask();
  }
  BackgroundModel model;
  Decision decision;
  bool limits = true;  // of pixels
  double threshold = 18;
  Shadows shadows = Shadows::background;
};

// A floor with a texture, in colours.
Planes floor_of(int width, int height, std::mt19937& rng) {
  Planes floor(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int grain = static_cast<int>(rng() % 41) - 20;
      floor.at(0, x, y) = static_cast<uint8_t>(150 + grain);
      floor.at(1, x, y) = static_cast<uint8_t>(130 + grain);
      floor.at(2, x, y) = static_cast<uint8_t>(100 + grain);
    }
  return floor;
}

size_t white(const uint8_t* mask, size_t count) {
  return static_cast<size_t>(std::count(mask, mask + count, uint8_t{255}));
}

constexpr Levels kLimited = {{16, 128, 128}, {235, 128, 128}},
                 kFull = {{0, 128, 128}, {255, 128, 128}};

// Less light: chroma goes with luma's distance from black, wherever black is.
TEST(Light, GoesDownToTheBlackOfItsRange) {
  std::mt19937 rng(340);
  for (const Levels& levels : {kFull, kLimited}) {
    const int black = levels.black[0];
    Planes floor(320, 240);
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < 320; ++x) {
        const int grain = static_cast<int>(rng() % 21) - 10;
        floor.at(0, x, y) = static_cast<uint8_t>(black + 70 + grain);
        floor.at(1, x, y) = static_cast<uint8_t>(128 - 90);
        floor.at(2, x, y) = static_cast<uint8_t>(128 + 100);
      }
    Planes frame = floor;
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < 160; ++x)
        for (int c = 0; c < 3; ++c) {
          const int dark = levels.black[c], level = frame.at(c, x, y);
          frame.at(c, x, y) = static_cast<uint8_t>(std::lround(dark + 0.6 * (level - dark)));
        }
    const auto white_of = [&](const Levels& assumed) {
      // Little noise, so that little rest is left to light.
      Decided decided(floor, {}, Colours::yuv, assumed, 4);
      decided.threshold = 8;
      return white(decided(frame), floor.pixels());
    };
    EXPECT_LT(white_of(levels), 0.01 * 160 * 240) << black;
    // Such a change is no light where black is elsewhere.
    EXPECT_GT(white_of(black == 0 ? kLimited : kFull), 0.5 * 160 * 240) << black;
  }
}

TEST(Light, IsNoForeground) {
  std::mt19937 rng(322);
  for (Colours colours : {Colours::rgb, Colours::yuv, Colours::grey}) {
    SCOPED_TRACE(static_cast<int>(colours));
    const auto samples = [&](Planes picture) {
      if (colours == Colours::rgb) return picture;
      for (size_t p = 0; p < picture.pixels(); ++p) {
        const double r = picture.level[0][p], g = picture.level[1][p], b = picture.level[2][p];
        const double y = 0.299 * r + 0.587 * g + 0.114 * b;
        const bool grey = colours == Colours::grey;
        picture.level[0][p] = static_cast<uint8_t>(grey ? y : 16.5 + 0.859 * y);
        picture.level[1][p] = static_cast<uint8_t>(grey ? y : 128.5 + 0.496 * (b - y));
        picture.level[2][p] = static_cast<uint8_t>(grey ? y : 128.5 + 0.627 * (r - y));
      }
      return picture;
    };
    const Planes floor = floor_of(320, 240, rng);
    Planes frame = floor;
    // A shadow on the left half, a light on the right one, and somebody in between.
    const auto somebody = [](int x, int y) {
      return std::abs(x - 160) < 20 && std::abs(y - 120) < 50;
    };
    for (int c = 0; c < 3; ++c)
      for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x) {
          uint8_t& level = frame.at(c, x, y);
          level = static_cast<uint8_t>(level * (x < 160 ? 0.65 : 1.12));
          if (somebody(x, y)) level = c == 2 ? 170 : 60;
        }
    for (Shadows shadows : {Shadows::background, Shadows::foreground, Shadows::marked}) {
      Decided decided(samples(floor), {}, colours, colours == Colours::yuv ? kLimited : Levels{});
      decided.shadows = shadows;
      const uint8_t* mask = decided(samples(frame));
      size_t inside = 0, dark = 0, marked = 0;
      for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x) {
          const auto p = static_cast<size_t>(y * 320 + x);
          if (somebody(x, y)) inside += mask[p] == 255;
          if (x < 130) dark += mask[p] == 255;
          if (x < 130 && decided.decision.shaded()) marked += decided.decision.shaded()[p] == 255;
        }
      EXPECT_GT(inside, 0.97 * 39 * 99);
      // A grey picture has no colour by which light could be told from things.
      if (shadows == Shadows::foreground || colours == Colours::grey) {
        EXPECT_GT(dark, 0.95 * 130 * 240);
      } else {
        EXPECT_LT(dark, 0.01 * 130 * 240);
      }
      if (shadows == Shadows::marked && colours != Colours::grey) {
        EXPECT_GT(marked, 0.95 * 130 * 240);
      }
      EXPECT_EQ(decided.decision.shaded() != nullptr, shadows == Shadows::marked);
    }
  }
}

// Leaves: the picture, each part of it moved a little by itself.
Planes in_wind(Planes& leaves, int right, std::mt19937& rng) {
  Planes moved = leaves;
  for (int top = 0; top < leaves.height; top += 8)
    for (int left = 0; left < right; left += 8) {
      const int dx = static_cast<int>(rng() % 5) - 2, dy = static_cast<int>(rng() % 5) - 2;
      for (int y = top; y < std::min(top + 8, leaves.height); ++y)
        for (int x = left; x < std::min(left + 8, right); ++x)
          for (int c = 0; c < 3; ++c) moved.at(c, x, y) = leaves.at(c, x + dx, y + dy);
    }
  return moved;
}

Planes leaves_of(int width, int height, std::mt19937& rng) {
  Planes leaves(width, height);
  for (int y = 0; y < height; y += 3)
    for (int x = 0; x < width; x += 3) {
      const bool leaf = rng() % 2;
      for (int c = 0; c < 3; ++c)
        for (int i = 0; i < 9; ++i)
          leaves.at(c, x + i % 3, y + i / 3) =
              static_cast<uint8_t>((leaf ? 70 - 20 * c : 200) + static_cast<int>(rng() % 9));
    }
  return leaves;
}

TEST(MovingTexture, IsNoForeground) {
  std::mt19937 rng(323);
  Planes leaves = leaves_of(320, 240, rng);
  for (bool known : {true, false}) {
    Decided decided(leaves, {true, true, known, true, true, true});
    size_t false_positives = 0, hits = 0;
    for (int t = 0; t < 200; ++t) {
      Planes frame = in_wind(leaves, 200, rng);
      // Somebody goes past, from frame 100 on.
      const int left = t < 100 ? 400 : 2 * (t - 100);
      for (int y = 60; y < 180; ++y)
        for (int x = left; x < std::min(320, left + 40); ++x)
          for (int c = 0; c < 3; ++c) frame.at(c, x, y) = c == 2 ? 220 : 90;
      const uint8_t* mask = decided(frame);
      if (t < 50) continue;
      const size_t all = white(mask, frame.pixels());
      size_t inside = 0;
      for (int y = 60; y < 180; ++y)
        for (int x = left; x < std::min(320, left + 40); ++x) inside += mask[y * 320 + x] == 255;
      hits += inside;
      false_positives += all - inside;
    }
    const double of_leaves = static_cast<double>(false_positives) / (150.0 * 200 * 240);
    if (known) {
      EXPECT_LT(of_leaves, 0.005);
      EXPECT_GT(static_cast<double>(hits), 0.8 * 100 * 40 * 120);
    } else {
      EXPECT_GT(of_leaves, 0.05) << "they move";
    }
  }
}

// The background's leaves, a little beside.
Planes shifted(Planes& leaves, int right) {
  Planes moved = leaves;
  for (int y = 0; y < leaves.height; ++y)
    for (int x = 0; x < right; ++x)
      for (int c = 0; c < 3; ++c) moved.at(c, x, y) = leaves.at(c, x + 2, y + 1);
  return moved;
}

TEST(MovingTexture, IsNobodyWhoStandsBesideHisPicture) {
  std::mt19937 rng(333);
  Planes leaves = leaves_of(320, 240, rng);
  for (double restless : {DecisionConstants().restless, -1.0}) {
    DecisionSteps steps;
    steps.constants.restless = restless;
    Decided decided(leaves, steps);
    const Planes beside = shifted(leaves, 100);
    size_t hits = 0;
    for (int t = 0; t < 100; ++t) {
      Planes frame = beside;
      for (auto& plane : frame.level)
        for (uint8_t& sample : plane) sample = static_cast<uint8_t>(sample + rng() % 5);
      const uint8_t* mask = decided(frame);
      if (t >= 50) hits += white(mask, frame.pixels());
    }
    // Explained by the background next to it, all the time.
    const double found = static_cast<double>(hits) / (50.0 * 100 * 240);
    if (restless > 0) {
      EXPECT_GT(found, 0.2);
    } else {
      EXPECT_LT(found, 0.05);
    }
  }
}

TEST(MovingTexture, IsNoneOfAModelWithoutLimits) {
  std::mt19937 rng(334);
  Planes leaves = leaves_of(320, 240, rng);
  // Nor learns their noise here.
  Decided decided(leaves, {true, false, true, true, true, true});
  decided.limits = false;
  size_t hits = 0;
  for (int t = 0; t < 60; ++t) {
    const uint8_t* mask = decided(in_wind(leaves, 200, rng));
    if (t >= 50) hits += white(mask, leaves.pixels());
  }
  EXPECT_GT(static_cast<double>(hits), 0.05 * 10 * 200 * 240);
}

TEST(MovingTexture, DoesNotHideWhatComesSuddenly) {
  std::mt19937 rng(335);
  Planes leaves = leaves_of(320, 240, rng);
  for (double suddenly : {DecisionConstants().suddenly, 1e6}) {
    DecisionSteps steps;
    steps.constants.suddenly = suddenly;
    // Pixels have a noise of their own, which hides more.
    steps.noise = false;
    Decided decided(leaves, steps);
    size_t hits = 0;
    for (int t = 0; t < 101; ++t) {
      // A few of the leaves move; then all of them, which the second such frame knows.
      Planes frame = leaves;
      const Planes wind = t < 99 ? in_wind(leaves, 300, rng) : shifted(leaves, 300);
      for (int top = 0; top < 240; top += 8)
        for (int left = 0; left < 320; left += 8)
          if (t >= 99 || rng() % 10 == 0)
            for (int c = 0; c < 3; ++c)
              for (int y = top; y < top + 8; ++y)
                std::copy_n(&wind.level[c][static_cast<size_t>(y * 320 + left)], 8,
                            &frame.at(c, left, y));
      const uint8_t* mask = decided(frame);
      if (t == 100) hits = white(mask, frame.pixels());
    }
    if (suddenly < 10) {
      EXPECT_GT(hits, 0.2 * 300 * 240);
    } else {
      EXPECT_LT(hits, 0.1 * 300 * 240);
    }
  }
}

TEST(PixelNoise, LearnsWhatComesAndGoes) {
  std::mt19937 rng(336);
  const Planes floor = floor_of(320, 240, rng);
  for (bool known : {true, false}) {
    DecisionSteps steps;
    if (!known) steps.constants.most_of_moments = 0;
    Decided decided(floor, steps);
    size_t of_lamp = 0, of_somebody = 0;
    for (int t = 0; t < 600; ++t) {
      Planes frame = floor;
      // A lamp is on in two frames of five, somebody passes every 50 frames.
      const bool on = rng() % 5 < 2;
      const int left = 160 + 10 * (t % 50);
      for (int c = 0; c < 3; ++c)
        for (int y = 60; y < 120; ++y) {
          for (int x = 40; on && x < 100; ++x) frame.at(c, x, y) += 25;
          for (int x = left; x < left + 30 && x < 320; ++x)
            frame.at(c, x, y) = static_cast<uint8_t>(c == 2 ? 200 : 40);
        }
      const uint8_t* mask = decided(frame);
      if (t < 400) continue;
      for (int y = 60; y < 120; ++y)
        for (int x = 0; x < 320; ++x) {
          const size_t hit = mask[y * 320 + x] == 255;
          (x < 110 ? of_lamp : of_somebody) += hit;
        }
    }
    const double all_of_lamp = 200 * 0.4 * 60 * 60, all_of_somebody = 200 / 50.0 * 15.5 * 30 * 60;
    if (known) {
      EXPECT_LT(static_cast<double>(of_lamp), 0.3 * all_of_lamp);
    } else {
      EXPECT_GT(static_cast<double>(of_lamp), 0.5 * all_of_lamp);
    }
    EXPECT_GT(static_cast<double>(of_somebody), 0.9 * all_of_somebody);
  }
}

TEST(MovingTexture, IsNobodyWhoStays) {
  std::mt19937 rng(324);
  const Planes floor = floor_of(320, 240, rng);
  Decided decided(floor);
  size_t hits = 0;
  for (int t = 0; t < 400; ++t) {
    Planes frame = floor;
    // Stays from frame 60 on, and does not stand still.
    const int left = 140 + static_cast<int>(rng() % 3);
    if (t >= 60)
      for (int y = 60; y < 180; ++y)
        for (int x = left; x < left + 40; ++x)
          for (int c = 0; c < 3; ++c)
            frame.at(c, x, y) = static_cast<uint8_t>(c == 0 ? 30 + (y + x - left) % 20 : 70);
    const uint8_t* mask = decided(frame);
    if (t >= 60) hits += white(mask, frame.pixels());
  }
  EXPECT_GT(static_cast<double>(hits), 0.97 * 340 * 40 * 120);
}

TEST(Decision, DoesNotDependOnThreadsOrOnThePast) {
  std::mt19937 rng(325);
  Planes leaves = leaves_of(700, 500, rng);
  Decided one(leaves), three(leaves), again(leaves);
  Pool pool(3);
  std::vector<Planes> frames;
  for (int t = 0; t < 60; ++t) frames.push_back(in_wind(leaves, 400, rng));
  for (const Planes& frame : frames) again(frame);
  again.decision.forget();
  EXPECT_TRUE(again.decision.new_born());
  for (const Planes& frame : frames) {
    const uint8_t* const expected = one(frame);
    ASSERT_TRUE(std::equal(expected, expected + frame.pixels(), three(frame, &pool)));
    ASSERT_TRUE(std::equal(expected, expected + frame.pixels(), again(frame)));
  }
}

// ---- Streams in which there is little to see, at the defaults ----

// The share of white in each mask.
std::vector<double> masks_of(const std::vector<Planes>& frames, Mode mode,
                             bool masks_expected = true) {
  EngineOptions options;
  options.mode = mode;
  options.window_size = 50;
  options.threads = 1;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, frames[0].width, frames[0].height).ok());
  Wishes wishes = first_wishes(options);
  wishes.masks_expected = masks_expected;
  PackedPicture picture(frames[0].width, frames[0].height, 3, false, 0);
  std::vector<double> shares;
  const auto pop = [&] {
    while (engine.next()) {
      engine.next()->pop(Output::mask, picture.out());
      const auto planes = picture.planes();
      const size_t pixels = frames[0].pixels();
      for (size_t i = 0; i < planes.size(); ++i) EXPECT_TRUE(planes[i] == 0 || planes[i] == 255);
      shares.push_back(static_cast<double>(white(planes.data(), pixels)) /
                       static_cast<double>(pixels));
    }
  };
  for (const Planes& frame : frames) {
    std::vector<uint8_t> planes;
    for (const auto& level : frame.level) planes.insert(planes.end(), level.begin(), level.end());
    picture.fill(planes);
    EXPECT_TRUE(engine.push(picture.in(), &wishes).ok());
    pop();
  }
  EXPECT_TRUE(engine.drain().ok());
  pop();
  EXPECT_EQ(shares.size(), frames.size());
  return shares;
}

TEST(LittleToSee, HasNoForeground) {
  std::mt19937 rng(326);
  for (Mode mode : {Mode::batch, Mode::live})
    for (auto [width, height] : {std::pair{1, 1}, {1, 40}, {300, 1}, {2, 3}, {64, 48}})
      for (int level : {0, 1, 90, 255})
        for (size_t count : {1u, 2u, 60u}) {
          SCOPED_TRACE(testing::Message() << width << "x" << height << " of " << level);
          Planes still(width, height);
          for (auto& plane : still.level)
            for (uint8_t& sample : plane)
              sample = static_cast<uint8_t>(level == 90 ? rng() % 256 : static_cast<size_t>(level));
          for (double share : masks_of({count, still}, mode)) ASSERT_EQ(share, 0);
        }
}

TEST(Rehearsal, KnowsLeavesFromTheFirstFrameOnWhereMasksAreExpected) {
  std::mt19937 rng(327);
  Planes leaves = leaves_of(320, 240, rng);
  std::vector<Planes> frames;
  for (int t = 0; t < 50; ++t) frames.push_back(in_wind(leaves, 200, rng));
  const auto expected = masks_of(frames, Mode::batch),
             surprised = masks_of(frames, Mode::batch, false);
  EXPECT_LT(expected.front(), 0.01);
  EXPECT_GT(surprised.front(), 0.05);
  EXPECT_LT(surprised.back(), 0.01);
}

// In a time lapse of a busy street, each thing is at its place in one frame only.
TEST(TimeLapse, WhatPassesIsNoNoise) {
  const auto seen_at = [](double frame_rate) {
    std::mt19937 rng(329);
    std::normal_distribution<double> noise(0, 2);
    Planes street = floor_of(96, 64, rng);
    EngineOptions options;
    options.mode = Mode::live;
    options.threads = 1;
    options.stabilize = Stabilize::off;
    options.frame_rate = frame_rate;
    Engine engine;
    EXPECT_TRUE(engine.configure(options, 96, 64).ok());
    PackedPicture frame(96, 64, 3), mask(96, 64, 3);
    size_t found = 0, all = 0;
    for (int t = 0; t < 500; ++t) {
      const size_t left = 20 + rng() % 40, top = 10 + rng() % 10;
      for (size_t p = 0; p < frame.pixels(); ++p) {
        const size_t x = p % 96, y = p / 96;
        const bool thing = t >= 20 && x >= left && x < left + 10 && y >= top && y < top + 24;
        for (size_t c = 0; c < 3; ++c) {
          const double level = thing ? (c == 0 ? 150 : 60) : street.level[c][p];
          frame.at(c, p) =
              static_cast<uint8_t>(std::lround(std::clamp(level + noise(rng), 0.0, 255.0)));
        }
      }
      EXPECT_TRUE(engine.push(frame.in()).ok());
      engine.next()->pop(Output::mask, mask.out());
      if (t < 300) continue;
      for (size_t y = top; y < top + 24; ++y)
        for (size_t x = left; x < left + 10; ++x, ++all) found += mask.at(0, y * 96 + x) > 0;
    }
    return static_cast<double>(found) / static_cast<double>(all);
  };
  const double lapse = seen_at(1), unknown = seen_at(0);
  EXPECT_GT(lapse, 0.98);
  EXPECT_LT(unknown, lapse - 0.01);  // There is something to mend.
  EXPECT_EQ(unknown, seen_at(25));
}

TEST(LittleToSee, NoiseIsNoForeground) {
  std::mt19937 rng(327);
  for (double sigma : {1.0, 5.0, 12.0}) {
    std::normal_distribution<double> noise(0, sigma);
    const Planes floor = floor_of(160, 120, rng);
    std::vector<Planes> frames(120, floor);
    for (Planes& frame : frames)
      for (auto& plane : frame.level)
        for (uint8_t& sample : plane)
          sample = static_cast<uint8_t>(std::lround(std::clamp(sample + noise(rng), 0.0, 255.0)));
    for (Mode mode : {Mode::batch, Mode::live}) {
      const auto shares = masks_of(frames, mode);
      // Live: once there is a model of more than a frame.
      const auto first = shares.begin() + (mode == Mode::live ? 20 : 0);
      const double mean = std::accumulate(first, shares.end(), 0.0) / double(shares.end() - first);
      EXPECT_LT(mean, 1e-4) << sigma;
    }
  }
}

TEST(LittleToSee, ALensThatWasCovered) {
  std::mt19937 rng(328);
  const Planes floor = floor_of(160, 120, rng);
  std::vector<Planes> frames(150, floor);
  for (size_t t = 70; t < 80; ++t) frames[t] = Planes(160, 120);
  for (Mode mode : {Mode::batch, Mode::live}) {
    const auto shares = masks_of(frames, mode);
    for (size_t t = 0; t < shares.size(); ++t)
      if (t < 70 || t > 82) {
        EXPECT_LT(shares[t], 0.01) << t;
      }
  }
}

}  // namespace
}  // namespace qdmd::test
