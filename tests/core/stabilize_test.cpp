// SPDX-License-Identifier: LGPL-2.1-or-later
// The engine before a camera that moves.
#include <cmath>
#include <random>

#include "tests/core/engine_util.h"
#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

constexpr int kWidth = 160, kHeight = 120;

struct Film {
  std::vector<std::vector<uint8_t>> frames, backgrounds,
      masks;  // packed R, G, B; masks: one sample
};
Film film(const std::string& text, int count, int width = kWidth, int height = kHeight) {
  Film film;
  Scene scene(options(width, height), text);
  for (int t = 0; t < count; ++t) {
    const Shot shot = shoot(&scene, t);
    film.frames.push_back(shot.frame);
    film.backgrounds.push_back(shot.background);
    film.masks.push_back(shot.labels);
  }
  return film;
}

EngineOptions robust(Stabilize stabilize, Mode mode = Mode::batch) {
  EngineOptions options;
  options.mode = mode;
  options.window_size = 40;
  options.stabilize = stabilize;
  return options;
}

template <typename Byte>
BasicImageView<Byte> view_of(Byte* samples, int width, int height) {
  BasicImageView<Byte> view;
  for (int c = 0; c < 3; ++c) view.channel[c] = samples + c;
  view.width = width;
  view.height = height;
  view.pixel_stride = 3;
  view.row_stride = ptrdiff_t{3} * width;
  return view;
}

struct Result {
  std::vector<std::vector<uint8_t>> pictures;
  std::vector<Pose> poses;  // of the frames as they left
};
Result run(const Film& film, EngineOptions options, Output output, bool steady = false,
           int width = kWidth, int height = kHeight) {
  Result result;
  Engine engine;
  options.stabilize_output = steady;
  EXPECT_TRUE(engine.configure(options, width, height).ok());
  const auto take = [&] {
    while (engine.next()) {
      result.poses.push_back(engine.next()->pose());
      auto& picture = result.pictures.emplace_back(film.frames[0].size());
      engine.next()->pop(output, view_of(picture.data(), width, height));
    }
  };
  for (const auto& frame : film.frames) {
    EXPECT_TRUE(engine.push(view_of(frame.data(), width, height)).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  EXPECT_EQ(result.pictures.size(), film.frames.size());
  return result;
}

double distance_of(const std::vector<std::vector<uint8_t>>& a,
                   const std::vector<std::vector<uint8_t>>& b) {
  double sum = 0, count = 0;
  for (size_t t = 0; t < a.size(); ++t)
    for (size_t i = 0; i < a[t].size(); ++i, ++count) sum += std::abs(a[t][i] - b[t][i]);
  return sum / count;
}

// F of masks of R, G, B samples, from the second quarter on.
double f_of(const Result& result, const Film& film) {
  double hit = 0, all = 0;
  for (size_t t = film.masks.size() / 4; t < film.masks.size(); ++t)
    for (size_t i = 0; i < film.masks[t].size(); ++i) {
      const bool seen = result.pictures[t][3 * i] > 127, right = film.masks[t][i] == 255;
      hit += seen && right ? 2 : 0;
      all += (seen ? 1 : 0) + (right ? 1 : 0);
    }
  return all > 0 ? hit / all : 1;
}

TEST(Stabilize, AStillCameraChangesNotABit) {
  for (const char* text :
       {"basic", "basic,bootstrap,fade", "basic,clutter=0.95", "storm,jitter=0"}) {
    const Film still = film(text, 90);
    for (const Mode mode : {Mode::batch, Mode::live})
      for (const Output output : {Output::background, Output::mask, Output::cutout})
        EXPECT_EQ(run(still, robust(Stabilize::similarity, mode), output).pictures,
                  run(still, robust(Stabilize::off, mode), output).pictures)
            << text;
  }
}

TEST(Stabilize, ShakingBackgroundsAndMasksAreWhereTheyAre) {
  const Film shaken = film("basic,jitter=2", 120), still = film("basic", 120);
  for (const Mode mode : {Mode::batch, Mode::live}) {
    const EngineOptions off = robust(Stabilize::off, mode),
                        on = robust(Stabilize::translation, mode);
    const double without =
        distance_of(run(shaken, off, Output::background).pictures, shaken.backgrounds);
    const double with =
        distance_of(run(shaken, on, Output::background).pictures, shaken.backgrounds);
    EXPECT_LT(with, without / 3);
    EXPECT_LT(with, 2.5);
    const double f = f_of(run(shaken, on, Output::mask), shaken);
    EXPECT_GT(f, f_of(run(shaken, off, Output::mask), shaken) + 0.2);
    EXPECT_GT(f, f_of(run(still, off, Output::mask), still) - 0.08);
  }
}

// Leaves near the camera hide most of the picture, and many of them move alike.
TEST(Stabilize, LeavesBeforeTheSceneAreNoMotion) {
  for (const char* text : {"foliage", "foliage,noise=2", "foliage:rest=3"}) {
    const Film leaves = film(text, 150, 320, 240);
    const Result result =
        run(leaves, robust(Stabilize::translation, Mode::live), Output::mask, false, 320, 240);
    EXPECT_EQ(std::count(result.poses.begin(), result.poses.end(), Pose()), 150) << text;
  }
}

TEST(Stabilize, EveryMethodGainsByIt) {
  const Film shaken = film("basic,jitter=2:rotation=1", 80);
  for (const Method method : {Method::qdmd, Method::dmd, Method::robust})
    for (const Mode mode : {Mode::batch, Mode::live}) {
      EngineOptions options = robust(Stabilize::similarity, mode);
      options.method = method;
      if (method != Method::robust) options.dmd.rank = 1;
      const double with =
          distance_of(run(shaken, options, Output::background).pictures, shaken.backgrounds);
      options.stabilize = Stabilize::off;
      EXPECT_LT(with, 0.6 * distance_of(run(shaken, options, Output::background).pictures,
                                        shaken.backgrounds));
    }
}

// Who subtracts a background from its frame, or looks at a cut-out, sees the frame as it came.
TEST(Stabilize, CutOutsAndResidualsAreOfTheUntouchedFrame) {
  const Film shaken = film("basic,jitter=2", 60);
  const EngineOptions options = robust(Stabilize::translation);
  const auto masks = run(shaken, options, Output::mask).pictures;
  const auto cutouts = run(shaken, options, Output::cutout).pictures;
  const auto backgrounds = run(shaken, options, Output::background).pictures;
  const auto residuals = run(shaken, options, Output::foreground).pictures;
  size_t white = 0;
  for (size_t t = 0; t < masks.size(); ++t)
    for (size_t i = 0; i < masks[t].size(); ++i) {
      ASSERT_EQ(cutouts[t][i], masks[t][i] == 255 ? shaken.frames[t][i] : 0);
      ASSERT_EQ(residuals[t][i], std::abs(shaken.frames[t][i] - backgrounds[t][i]));
      white += masks[t][i] == 255 ? 1 : 0;
    }
  EXPECT_GT(white, 0u);
}

TEST(Stabilize, TheSteadyPictureStandsStill) {
  const Film shaken = film("noise,jitter=3", 80);
  const EngineOptions options = robust(Stabilize::translation);
  const auto change = [](const std::vector<std::vector<uint8_t>>& pictures) {
    // Both are of one window: between windows the background is another one.
    return distance_of({pictures.begin() + 41, pictures.begin() + 79},
                       {pictures.begin() + 42, pictures.begin() + 80});
  };
  const double shaking = change(run(shaken, options, Output::background).pictures);
  EXPECT_GT(shaking, 1);
  EXPECT_LT(change(run(shaken, options, Output::background, true).pictures), 0.05 * shaking);
}

TEST(Stabilize, PosesAreTheSimulatorsTruth) {
  Scene scene(options(kWidth, kHeight), "basic,jitter=2");
  const Film shaken = film("basic,jitter=2", 100);
  const Result result = run(shaken, robust(Stabilize::translation), Output::background);
  std::vector<double> x, y;
  for (int t = 0; t < 100; ++t) {
    scene.render(t, 0);
    x.push_back(result.poses[static_cast<size_t>(t)].x - scene.shift_x());
    y.push_back(result.poses[static_cast<size_t>(t)].y - scene.shift_y());
  }
  // The canvas is where it is.
  for (auto* axis : {&x, &y}) {
    std::vector<double> sorted = *axis;
    std::sort(sorted.begin(), sorted.end());
    const double middle = sorted[sorted.size() / 2];
    const auto near = std::count_if(sorted.begin(), sorted.end(),
                                    [&](double way) { return std::abs(way - middle) < 0.1; });
    EXPECT_GE(near, 95);
  }
}

TEST(Stabilize, IsTheSameForAnyNumberOfThreads) {
  const Film shaken = film("basic,jitter=2", 60);
  EngineOptions options = robust(Stabilize::similarity);
  options.threads = 1;
  const auto alone = run(shaken, options, Output::mask).pictures;
  options.threads = 3;
  EXPECT_EQ(run(shaken, options, Output::mask).pictures, alone);
}

TEST(Stabilize, WithoutRoomForSecondCopiesFramesAreTakenAsTheyCome) {
  const Film shaken = film("basic,jitter=2", 60);
  EngineOptions options = robust(Stabilize::translation);
  options.max_memory = layout_of(options, kWidth, kHeight).bytes;
  Engine engine;
  ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  std::vector<uint8_t> out(shaken.frames[0].size());
  for (const auto& frame : shaken.frames) {
    ASSERT_TRUE(engine.push(view_of(frame.data(), kWidth, kHeight)).ok());
    while (engine.next()) engine.next()->pop(Output::mask, view_of(out.data(), kWidth, kHeight));
  }
  EXPECT_TRUE(engine.report().no_room_for_motion);
  EXPECT_LE(engine.report().bytes, options.max_memory);
}

TEST(Stabilize, ACameraThatGoesOnIsAnotherScene) {
  const Film pan = film("noise,jitter=0:drift=20:way=400", 150);
  for (const Method method : {Method::robust, Method::qdmd}) {
    EngineOptions options = robust(Stabilize::translation, Mode::live);
    options.method = method;
    Engine engine;
    ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
    std::vector<uint8_t> out(pan.frames[0].size());
    for (const auto& frame : pan.frames) {
      ASSERT_TRUE(engine.push(view_of(frame.data(), kWidth, kHeight)).ok());
      while (engine.next())
        engine.next()->pop(Output::background, view_of(out.data(), kWidth, kHeight));
    }
    EXPECT_GE(engine.report().views, 1u);
    EXPECT_GE(engine.report().scenes, engine.report().views);
  }
}

// A view that begins with a window's last frames leaves it fewer than a group.
TEST(Stabilize, AViewMayBeginAnywhereInAWindow) {
  const Film pan = film("noise,jitter=0:drift=20:way=400", 60);
  for (int window = 11; window <= 16; ++window) {
    EngineOptions options = robust(Stabilize::translation);
    options.method = Method::qdmd;
    options.window_size = window;
    const Result once = run(pan, options, Output::background);
    options.threads = 2;
    EXPECT_EQ(run(pan, options, Output::background).pictures, once.pictures) << window;
  }
}

TEST(Stabilize, TakesAnySizeAndAnyFrame) {
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 3}, {9, 8}, {31, 33}}) {
    Film any;
    for (const int level : {0, 0, 200, 200, 90, 0, 255, 90, 90, 91})
      any.frames.emplace_back(static_cast<size_t>(3 * width * height), static_cast<uint8_t>(level));
    std::mt19937 rng(8);
    for (int t = 0; t < 30; ++t)
      for (auto& sample : any.frames.emplace_back(any.frames[0].size()))
        sample = static_cast<uint8_t>(rng() >> 13);
    for (const Mode mode : {Mode::batch, Mode::live})
      for (const bool steady : {false, true}) {
        EngineOptions options = robust(Stabilize::similarity, mode);
        options.window_size = 8;
        run(any, options, Output::cutout, steady, width, height);
      }
  }
}

// Rectangles have their place in the frame, wherever its camera looks.
TEST(Stabilize, WhatIsIgnoredStaysWhereItIs) {
  const Film shaken = film("basic,bootstrap,jitter=3", 60);
  Engine engine;
  const EngineOptions options = robust(Stabilize::translation);
  ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  Wishes wishes = first_wishes(options);
  IgnoredAreas& areas = wishes.ignored;
  areas.add({40, 50, 60, 50});
  std::vector<uint8_t> out(shaken.frames[0].size());
  int inside = 0, outside = 0;
  for (const auto& frame : shaken.frames) {
    ASSERT_TRUE(engine.push(view_of(frame.data(), kWidth, kHeight), &wishes).ok());
    while (engine.next()) {
      engine.next()->pop(Output::mask, view_of(out.data(), kWidth, kHeight));
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
          if (out[static_cast<size_t>(3 * (y * kWidth + x))] > 0)
            ++(areas.has(x, y) ? inside : outside);
    }
  }
  EXPECT_EQ(inside, 0);
  EXPECT_GT(outside, 0);
}

// A flush and a new size forget the camera.
TEST(Stabilize, AfterAFlushTheNextFrameIsTheCanvas) {
  const Film shaken = film("basic,jitter=3", 50);
  Engine engine;
  ASSERT_TRUE(engine.configure(robust(Stabilize::translation, Mode::live), kWidth, kHeight).ok());
  std::vector<uint8_t> out(shaken.frames[0].size());
  for (const auto& frame : shaken.frames) {
    ASSERT_TRUE(engine.push(view_of(frame.data(), kWidth, kHeight)).ok());
    engine.next()->pop(Output::mask, view_of(out.data(), kWidth, kHeight));
  }
  EXPECT_FALSE(engine.report().newest_pose.is_rest());
  engine.flush();
  ASSERT_TRUE(engine.push(view_of(shaken.frames.back().data(), kWidth, kHeight)).ok());
  EXPECT_TRUE(engine.report().newest_pose.is_rest());
}

}  // namespace
}  // namespace qdmd::test
