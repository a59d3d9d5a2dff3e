// SPDX-License-Identifier: LGPL-2.1-or-later
// Flat things before water and leaves: what is told from them, and a boat on a simulated lake.
#include "core/foreground/flat_things.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "core/engine/engine.h"
#include "core/parallel/pool.h"
#include "core/scene/scene.h"
#include "gtest/gtest.h"
#include "tests/core/mask_util.h"

namespace qdmd::test {
namespace {

constexpr Rectangle kPlace = {40, 30, 48, 32};

// What is visited: each pixel once at most, all that was set to foreground, and nothing far from
// `place`; nothing at all where nothing was set.
void check_visits(const FlatThings& things, int width, const std::vector<uint8_t>& foreground,
                  const Rectangle& place, int margin) {
  Pool pool(2);
  std::vector<int> visits(foreground.size());
  things.visit_runs(&pool, [&](int y, int left, int count) {
    for (int x = left; x < left + count; ++x) ++visits[static_cast<size_t>(y * width + x)];
  });
  for (size_t p = 0; p < visits.size(); ++p) {
    const int x = static_cast<int>(p) % width, y = static_cast<int>(p) / width;
    const bool near = x >= place.x - margin && x < place.x + place.width + margin &&
                      y >= place.y - margin && y < place.y + place.height + margin;
    ASSERT_LE(visits[p], near ? 1 : 0) << x << ", " << y;
    ASSERT_GE(visits[p], foreground[p] / 255) << x << ", " << y;
  }
  if (std::count(foreground.begin(), foreground.end(), 255) == 0) {
    ASSERT_EQ(std::count(visits.begin(), visits.end(), 0), std::ssize(visits));
  }
}

// The share of kPlace that is found after 40 frames of restless water, in the frame that paint()
// has changed.
template <typename Paint>
double found_in(int step, const Paint& paint) {
  std::mt19937 rng(664);
  const int width = 160 * step, height = 120 * step;
  Floor level(width, height);
  level.paint({0, 0, width, height}, {120, 120, 120});
  std::vector<uint8_t> differing(level.pixels(), 255), foreground;
  FlatThings things(width, height, step, Colours::rgb);
  const Rectangle place = {kPlace.x * step, kPlace.y * step, kPlace.width * step,
                           kPlace.height * step};
  for (int t = 0; t <= 40; ++t) {
    Floor frame = level;
    for (size_t p = 0; p < level.pixels(); ++p) {
      const auto wave = static_cast<uint8_t>(80 + rng() % 80);
      for (auto& plane : frame.level) plane[p] = wave;
    }
    if (t == 40) paint(place, &frame);
    FlatThings::Planes planes = {};
    for (int c = 0; c < 3; ++c)
      planes.x[c] = frame.level[c].data(), planes.l[c] = level.level[c].data();
    planes.differing = differing.data();
    planes.x_stride = planes.l_stride = static_cast<size_t>(width);
    foreground.assign(level.pixels(), 0);
    things.keep(planes, nullptr, foreground.data());
    // Blocks have four samples, and reach one block further.
    check_visits(things, width, foreground, place, 8 * step);
    if (t < 40) {
      EXPECT_EQ(std::count(foreground.begin(), foreground.end(), 255), 0);
    }
  }
  return static_cast<double>(std::count(foreground.begin(), foreground.end(), 255)) /
         (place.width * place.height);
}

void scale(const Rectangle& place, double gain, Floor* frame) {
  for (auto& plane : frame->level)
    for (int y = place.y; y < place.y + place.height; ++y)
      for (int x = place.x; x < place.x + place.width; ++x) {
        uint8_t& sample = plane[frame->index(x, y)];
        sample = static_cast<uint8_t>(std::lround(gain * sample));
      }
}

TEST(FlatThings, AreToldByTheirOwnLook) {
  for (int step : {1, 2}) {
    SCOPED_TRACE(step);
    EXPECT_NEAR(found_in(step,
                         [](const Rectangle& place, Floor* frame) {
                           frame->paint(place, {50, 50, 55});
                         }),
                1, 0.05);
    // Less light leaves the water its texture.
    EXPECT_EQ(
        found_in(step, [](const Rectangle& place, Floor* frame) { scale(place, 0.3, frame); }), 0);
    // Nobody knows what samples at their end would be.
    EXPECT_EQ(found_in(step,
                       [](const Rectangle& place, Floor* frame) {
                         frame->paint(place, {255, 255, 255});
                       }),
              0);
    // A wave has a back, but not such a large one.
    EXPECT_EQ(
        found_in(
            step,
            [](const Rectangle& place, Floor* frame) {
              frame->paint({place.x, place.y, place.width / 3, place.height / 3}, {50, 50, 55});
            }),
        0);
    // Neither are blocks of many levels one thing.
    EXPECT_EQ(
        found_in(step,
                 [](const Rectangle& place, Floor* frame) {
                   for (int i = 0; i < place.width; ++i) {
                     const int level = 20 + 10 * (i * 160 / frame->width % 4 * 3 + i / 16 * 2);
                     frame->paint({place.x + i, place.y, 1, place.height}, {level, level, level});
                   }
                 }),
        0);
  }
}

// ---- A boat ----

TEST(FlatThings, AreABoatOnALake) {
  constexpr int kWidth = 320, kHeight = 240, kFrames = 200;
  constexpr size_t kFirst = 75;
  scene::SceneOptions scene_options;
  scene_options.seed = 7;
  scene::Scene scene(scene_options, "noise,boat=4:from=3.5");
  std::vector<std::vector<uint8_t>> frames, labels;
  for (int t = 0; t < kFrames; ++t) {
    scene.render(t, scene::kFrame | scene::kLabels);
    // Without colour, light tells nothing.
    std::vector<uint8_t>& grey = frames.emplace_back();
    const std::vector<uint8_t>& rgb = scene.frame().samples;
    for (size_t p = 0; p < rgb.size(); p += 3)
      grey.push_back(static_cast<uint8_t>((rgb[p] + 2 * rgb[p + 1] + rgb[p + 2]) / 4));
    labels.push_back(scene.labels().samples);
  }
  const auto view_of = [](auto* grey) {
    BasicImageView<std::remove_pointer_t<decltype(grey)>> view;
    for (auto& channel : view.channel) channel = grey;
    view.width = kWidth, view.height = kHeight;
    view.pixel_stride = 1, view.row_stride = kWidth;
    return view;
  };
  for (const Mode mode : {Mode::batch, Mode::live})
    for (const bool flat : {false, true}) {
      EngineOptions options;
      options.mode = mode;
      options.colours = Colours::grey;
      options.steps.flat = flat;
      Engine engine;
      ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
      std::vector<uint8_t> mask(size_t{kWidth} * kHeight);
      size_t popped = 0;
      double hits = 0, white = 0, boat = 0;
      const auto pop = [&] {
        for (; engine.next(); ++popped) {
          engine.next()->pop(Output::mask, view_of(mask.data()));
          if (popped < kFirst) continue;
          for (size_t p = 0; p < mask.size(); ++p) {
            const bool is_boat = labels[popped][p] == scene::kObjectLabel;
            hits += mask[p] == 255 && is_boat;
            white += mask[p] == 255;
            boat += is_boat;
          }
        }
      };
      for (const std::vector<uint8_t>& frame : frames) {
        ASSERT_TRUE(engine.push(view_of(frame.data())).ok());
        pop();
      }
      ASSERT_TRUE(engine.drain().ok());
      pop();
      const double f = 2 * hits / (white + boat);
      if (flat) {
        EXPECT_GT(f, 0.7);
      } else {
        EXPECT_LT(f, 0.5);
      }
    }
}

}  // namespace
}  // namespace qdmd::test
