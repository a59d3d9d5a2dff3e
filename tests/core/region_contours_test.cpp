// SPDX-License-Identifier: LGPL-2.1-or-later
// What stands before what, by the edges along a region's border in full resolution.
#include "core/learn/robust/region_contours.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "core/base/levels.h"

namespace qdmd::test {
namespace {

struct Rect {
  int top, left, height, width;
  bool has(int y, int x) const {
    return y >= top && y < top + height && x >= left && x < left + width;
  }
};

// Levels of a picture, the three channels one after the other, not rounded.
using Levels = std::vector<double>;

class Pictures {
 public:
  Pictures(int width_, int height_, unsigned seed = 3)
      : width(width_), height(height_), grid(width_, height_), random_(seed) {}

  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  // Stones of 5 x 5 pixels whose levels differ by up to `contrast`, around 110.
  Levels wall(double contrast) {
    Levels levels(kChannels * pixels());
    std::vector<double> stone(static_cast<size_t>((width / 5 + 1) * (height / 5 + 1)));
    for (double& level : stone) level = std::uniform_real_distribution<double>(-0.5, 0.5)(random_);
    each(&levels, [&](int y, int x, double& level) {
      level = 110 + contrast * stone[static_cast<size_t>(y / 5 * (width / 5 + 1) + x / 5)];
    });
    return levels;
  }
  void put(const Rect& box, double level, Levels* into) const {
    each(into, [&](int y, int x, double& at) {
      if (box.has(y, x)) at = level;
    });
  }
  Levels with_noise(const Levels& of, double sigma) {
    std::normal_distribution<double> noise(0, sigma);
    Levels noisy = of;
    for (double& level : noisy) level += noise(random_);
    return noisy;
  }
  // The cells that a box covers by half, at least.
  std::vector<int> cells_in(const Rect& box) const {
    std::vector<int> cells;
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) {
        int in = 0, all = 0;
        for (int y = grid.top(row); y < grid.top(row + 1); ++y)
          for (int x = grid.left(col); x < grid.left(col + 1); ++x) {
            ++all;
            in += box.has(y, x);
          }
        if (2 * in >= all) cells.push_back(row * grid.cols + col);
      }
    return cells;
  }
  RegionContours compare(const Levels& look, const Levels& background,
                         const std::vector<int>& region, Gain light = kSameLight,
                         Gain model_light = kSameLight, int depth = 8) const {
    // Other frames around it.
    Window window(3, pixels(), depth);
    for (int t = 0; t < 3; ++t) write(t == 1 ? look : Levels(look.size(), 17), light, &window);
    BackgroundModel model;
    model.set_depth(depth);
    model.make_room(pixels(), false);
    OwnedPicture picture;
    picture.resize(pixels(), depth);
    for (size_t c = 0; c < kChannels; ++c)
      for (size_t p = 0; p < pixels(); ++p)
        set_sample(background[c * pixels() + p], depth, p, picture.samples(c));
    model.freeze_as(picture, nullptr, pixels());
    model.set_light(model_light);
    model.set_time(0);
    return contours_of(grid, region, {SnapshotRange(window), 1, light, &model, model_light});
  }

  int width, height;
  Grid grid;

 private:
  template <typename Work>
  void each(Levels* levels, const Work& work) const {
    for (size_t at = 0; at < levels->size(); ++at) {
      const auto p = static_cast<int>(at % pixels());
      work(p / width, p % width, (*levels)[at]);
    }
  }
  static void set_sample(double level, int depth, size_t p, MutableSamples to) {
    const int most = (1 << depth) - 1, unit = 1 << bits_below(depth);
    const auto sample =
        static_cast<int>(std::clamp(std::lround(level * unit), 0l, static_cast<long>(most)));
    to.high[p] = static_cast<uint8_t>(sample >> bits_below(depth));
    if (to.low) to.low[p] = static_cast<uint8_t>(sample % unit);
  }
  void write(const Levels& levels, const Gain& light, Window* window) const {
    const int slot = window->append();
    for (size_t c = 0; c < kChannels; ++c)
      for (size_t p = 0; p < pixels(); ++p)
        set_sample(levels[c * pixels() + p] * static_cast<double>(light[c]), window->depth(), p,
                   window->samples(slot, static_cast<int>(c)));
  }

  std::mt19937 random_;
};

// Sizes with cells of 2, 5 and 2.7 pixels.
class RegionContoursOf : public testing::TestWithParam<std::array<int, 2>> {
 protected:
  Pictures pictures(unsigned seed = 3) const { return {GetParam()[0], GetParam()[1], seed}; }
  // In the middle of the picture.
  Rect box() const {
    const auto [width, height] = GetParam();
    return {height / 4, width / 3, height / 3, width / 5};
  }
};
INSTANTIATE_TEST_SUITE_P(Sizes, RegionContoursOf,
                         testing::Values(std::array{128, 96}, std::array{320, 240},
                                         std::array{171, 131}));

// Whichever of the two pictures has it, in front of a bare wall and of one that has edges itself.
TEST_P(RegionContoursOf, ThePictureWithTheBoxHasTheStrongerContour) {
  for (unsigned seed = 1; seed <= 8; ++seed)
    for (const double contrast : {0.0, 40.0, 80.0}) {
      Pictures scene = pictures(seed);
      const Levels wall = scene.wall(contrast);
      Levels with_box = wall;
      scene.put(box(), 200, &with_box);
      const auto region = scene.cells_in(box());
      const RegionContours left = scene.compare(scene.with_noise(wall, 2),
                                                scene.with_noise(with_box, 2), region),
                           came = scene.compare(scene.with_noise(with_box, 2),
                                                scene.with_noise(wall, 2), region);
      EXPECT_GT(left.background, 1.5 * left.look) << seed << ", contrast " << contrast;
      EXPECT_GT(came.look, 1.5 * came.background) << seed << ", contrast " << contrast;
      // Both sides of two rows and two columns of pixels, all along the box.
      const auto border = static_cast<double>(2 * (box().width + box().height));
      EXPECT_NEAR(static_cast<double>(left.pairs), 2 * border, 0.1 * border) << contrast;
      EXPECT_EQ(left.open, 0u);
    }
}

// The border is that of the pixels that differ, not of cells: exact numbers.
TEST_P(RegionContoursOf, IsTheMeanStepBetweenPixelsThatAreTwoApart) {
  Pictures scene = pictures();
  const Levels wall = scene.wall(0);
  for (const int shift : {0, 1, 2}) {
    Rect place = box();
    place.left += shift, place.top += shift;
    Levels with_box = wall;
    scene.put(place, 145, &with_box);
    const RegionContours left = scene.compare(wall, with_box, scene.cells_in(place));
    EXPECT_EQ(left.background, 35);
    EXPECT_EQ(left.look, 0);
    // At each of the four sides two pixels deep.
    EXPECT_EQ(left.pairs, static_cast<size_t>(4 * (place.width + place.height)));
    EXPECT_EQ(left.open, 0u);
  }
  // Edges count up to a limit: what is very bright is no better proof.
  Levels bright = wall, brighter = wall;
  scene.put(box(), 230, &bright);
  scene.put(box(), 250, &brighter);
  const auto region = scene.cells_in(box());
  EXPECT_EQ(scene.compare(wall, bright, region).background,
            scene.compare(wall, brighter, region).background);
}

// Less than thirty levels in all three channels together are the same.
TEST_P(RegionContoursOf, WhatHardlyDiffersHasNoBorder) {
  Pictures scene = pictures();
  const Levels wall = scene.wall(0);
  for (const auto& [level, differs] : {std::pair{120, false}, {121, true}}) {
    Levels with_box = wall;
    scene.put(box(), level, &with_box);
    const RegionContours left = scene.compare(wall, with_box, scene.cells_in(box()));
    EXPECT_EQ(left.pairs > 0, differs) << level;
  }
}

// The box ends where the region does not: another one goes on there.
TEST_P(RegionContoursOf, PairsBesideWhatDiffersTooAreOpen) {
  Pictures scene = pictures();
  const Levels wall = scene.wall(40);
  Levels with_box = wall;
  const Rect whole = box();
  scene.put(whole, 200, &with_box);
  // A few of its columns are the region; and one side of that is open.
  const Rect part = {whole.top, whole.left, whole.height, whole.width / 3};
  const RegionContours of_part = scene.compare(wall, with_box, scene.cells_in(part));
  EXPECT_GT(of_part.open, static_cast<size_t>(whole.height));
  EXPECT_LE(of_part.open, static_cast<size_t>(2 * whole.height + 8));
  EXPECT_GT(of_part.pairs, 0u);
  EXPECT_GT(of_part.background, 2 * of_part.look);
  // In the middle of it no end is known.
  const Rect middle = {whole.top + whole.height / 4, whole.left + whole.width / 4, whole.height / 2,
                       whole.width / 2};
  const RegionContours of_middle = scene.compare(wall, with_box, scene.cells_in(middle));
  EXPECT_GT(of_middle.open, of_middle.pairs);
  // What differs far away from it does not matter.
  scene.put({0, 0, 8, 8}, 250, &with_box);
  EXPECT_EQ(scene.compare(wall, with_box, scene.cells_in(whole)).open, 0u);
}

TEST_P(RegionContoursOf, LightIsDividedOut) {
  Pictures scene = pictures();
  const Levels wall = scene.wall(40);
  Levels with_box = wall;
  scene.put(box(), 170, &with_box);
  const auto region = scene.cells_in(box());
  const RegionContours plain = scene.compare(wall, with_box, region);
  for (const Gain& light : {Gain{0.6f, 0.6f, 0.6f}, Gain{1.2f, 0.9f, 0.7f}})
    for (const Gain& model_light : {kSameLight, Gain{0.8f, 1.1f, 0.7f}}) {
      const RegionContours lit = scene.compare(wall, with_box, region, light, model_light);
      // Samples are rounded in the light.
      EXPECT_NEAR(lit.look, plain.look, 1);
      EXPECT_NEAR(lit.background, plain.background, 1);
      EXPECT_NEAR(static_cast<double>(lit.pairs), static_cast<double>(plain.pairs),
                  0.02 * static_cast<double>(plain.pairs));
      EXPECT_EQ(lit.open, 0u);
    }
}

TEST_P(RegionContoursOf, SamplesOfMoreBitsSayTheSame) {
  Pictures scene = pictures();
  const Levels wall = scene.wall(40);
  Levels with_box = wall;
  scene.put(box(), 200, &with_box);
  const auto region = scene.cells_in(box());
  const RegionContours plain = scene.compare(wall, with_box, region);
  for (const int depth : {10, 12, 16}) {
    const RegionContours deep =
        scene.compare(wall, with_box, region, kSameLight, kSameLight, depth);
    // Only the highest bits are read: half a level of difference.
    EXPECT_NEAR(deep.look, plain.look, 0.5) << depth;
    EXPECT_NEAR(deep.background, plain.background, 0.5) << depth;
    EXPECT_EQ(deep.pairs, plain.pairs) << depth;
    EXPECT_EQ(deep.open, 0u);
  }
}

// Nothing is known of what is beyond the picture.
TEST_P(RegionContoursOf, AtThePicturesBorderOnlyTheInnerSidesCount) {
  Pictures scene = pictures();
  const Levels wall = scene.wall(0);
  const auto [width, height] = GetParam();
  const int size = height / 4;
  for (const auto& [top, left] :
       {std::pair{0, 0}, {0, width - size}, {height - size, 0}, {height - size, width - size}}) {
    const Rect corner = {top, left, size, size};
    Levels with_box = wall;
    scene.put(corner, 145, &with_box);
    const RegionContours left_there = scene.compare(wall, with_box, scene.cells_in(corner));
    EXPECT_EQ(left_there.pairs, static_cast<size_t>(4 * size)) << top << ' ' << left;
    EXPECT_EQ(left_there.background, 35);
    EXPECT_EQ(left_there.look, 0);
  }
  // All of the picture has no border.
  Levels other = wall;
  scene.put({0, 0, height, width}, 190, &other);
  const RegionContours all = scene.compare(wall, other, scene.cells_in({0, 0, height, width}));
  EXPECT_EQ(all.pairs, 0u);
  EXPECT_EQ(all.open, 0u);
}

TEST_P(RegionContoursOf, NoCellsHaveNoBorder) {
  Pictures scene = pictures();
  const Levels wall = scene.wall(40);
  Levels with_box = wall;
  scene.put(box(), 200, &with_box);
  const RegionContours nothing = scene.compare(wall, with_box, {});
  EXPECT_EQ(nothing.pairs, 0u);
  EXPECT_EQ(nothing.open, 0u);
  EXPECT_EQ(nothing.look, 0);
  EXPECT_EQ(nothing.background, 0);
}

// Wider than what is evaluated at once, and of one row, one column or one pixel.
TEST(RegionContours, OfPicturesOfAnyShape) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 1}, {1, 2}, {3, 3}, {1, 700}, {3000, 1}, {3000, 4}}) {
    Pictures scene(width, height);
    const Levels dark(kChannels * scene.pixels(), 60), bright(dark.size(), 190);
    const Rect whole = {0, 0, height, width};
    const RegionContours all = scene.compare(dark, bright, scene.cells_in(whole));
    EXPECT_EQ(all.pairs, 0u) << width << " x " << height;
    EXPECT_EQ(all.open, 0u);
  }
  Pictures scene(6000, 4);
  const Levels wall(kChannels * scene.pixels(), 60);
  Levels with_box = wall;
  const Rect box = {0, 500, 4, 5000};
  scene.put(box, 95, &with_box);
  const RegionContours wide = scene.compare(wall, with_box, scene.cells_in(box));
  // Left and right, two pixels deep.
  EXPECT_EQ(wide.pairs, 16u);
  EXPECT_EQ(wide.background, 35);
  EXPECT_EQ(wide.look, 0);
}

}  // namespace
}  // namespace qdmd::test
