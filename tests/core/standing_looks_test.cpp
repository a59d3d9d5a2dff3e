// SPDX-License-Identifier: LGPL-2.1-or-later
// What cells show, cell by cell and in plain words, beside what is followed in blocks.
#include "core/learn/robust/standing_looks.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace qdmd::test {
namespace {

using Level = std::array<float, kChannels>;

float apart(const Level& a, const Level& b) {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

// One cell. The constants are those of standing_looks.cpp.
class SlowLook {
 public:
  void follow(const Level& now, int64_t number) {
    if (look_.frames > 0 && apart(now, look_.level) < 12) {
      add(now, number, std::max(0.1f, 1 / static_cast<float>(look_.frames + 1)), &look_);
      next_ = {};
      return;
    }
    if (next_.frames == 0 || apart(now, next_.level) >= 12)
      next_ = {now, number, number, 1};
    else
      add(now, number, 1 / static_cast<float>(next_.frames + 1), &next_);
    if (next_.frames == StandingLooks::kSteady) take_next();
  }
  const Level& level() const { return look_.level; }
  int64_t since() const { return look_.since; }
  bool known() const { return look_.frames > 0; }
  // How often it went on to show what was hidden.
  size_t returned() const { return returned_; }

 private:
  struct Look {
    Level level = {};
    int64_t since = 0, last = 0;
    int frames = 0;
  };

  static void add(const Level& now, int64_t number, float share, Look* look) {
    ++look->frames;
    look->last = number;
    for (size_t c = 0; c < kChannels; ++c) look->level[c] += share * (now[c] - look->level[c]);
  }

  void take_next() {
    const Look before = before_;
    before_ = look_;
    look_ = next_;
    next_ = {};
    // What was hidden for no longer than it had been there.
    if (before.frames > 0 && apart(look_.level, before.level) < 12 &&
        look_.since - before.last <= before.last - before.since) {
      look_.since = before.since;
      ++returned_;
    }
  }

  Look look_, next_, before_;
  size_t returned_ = 0;
};

// Shows one of three things for a while, with noise, and then another one.
class Scene {
 public:
  explicit Scene(size_t cells) : shown_(cells), left_(cells) {}

  std::vector<float> next() {
    std::vector<float> planes(kChannels * shown_.size());
    for (size_t cell = 0; cell < shown_.size(); ++cell) {
      if (left_[cell]-- == 0) {
        shown_[cell] = static_cast<int>(random_() % 3);
        // Often shorter and longer than it takes to be a look.
        left_[cell] = static_cast<int>(random_() % 40);
      }
      for (size_t c = 0; c < kChannels; ++c)
        planes[c * shown_.size() + cell] =
            static_cast<float>(60 + 50 * shown_[cell]) + static_cast<float>(random_() % 256) / 32;
    }
    return planes;
  }

 private:
  std::mt19937 random_{3};
  std::vector<int> shown_, left_;
};

// Grids of whole blocks of cells, of less than one, and with some left over.
class StandingLooksOf : public testing::TestWithParam<std::array<int, 2>> {};

TEST_P(StandingLooksOf, CellsAreThoseOfEachCellByItself) {
  const auto [width, height] = GetParam();
  const Grid grid(width, height);
  StandingLooks looks(grid);
  std::vector<SlowLook> slow(grid.cells());
  Scene scene(grid.cells());
  int64_t number = 5;
  size_t known = 0;
  for (int t = 0; t < 300; ++t) {
    if (t == 150) {
      looks.forget();
      slow.assign(grid.cells(), {});
    }
    const std::vector<float> planes = scene.next();
    const float* const frame[3] = {planes.data(), planes.data() + grid.cells(),
                                   planes.data() + 2 * grid.cells()};
    const Gain gain = t % 50 < 25 ? kSameLight : Gain{1.02f, 0.99f, 1.01f};
    // Frames may be left out.
    number += t % 7 == 0 ? 3 : 1;
    looks.follow(frame, gain, number);
    for (size_t cell = 0; cell < grid.cells(); ++cell) {
      Level now;
      for (size_t c = 0; c < kChannels; ++c) now[c] = frame[c][cell] * (1 / gain[c]);
      slow[cell].follow(now, number);
      if (!slow[cell].known()) continue;
      ++known;
      const int at = static_cast<int>(cell);
      ASSERT_EQ(looks.since(at), slow[cell].since()) << "frame " << t << ", cell " << cell;
      for (int c = 0; c < kChannels; ++c)
        ASSERT_EQ(looks.level(at, c), slow[cell].level()[static_cast<size_t>(c)])
            << "frame " << t << ", cell " << cell << ", channel " << c;
    }
  }
  EXPECT_GT(known, grid.cells());
  size_t returned = 0;
  for (const SlowLook& cell : slow) returned += cell.returned();
  EXPECT_GT(returned, 0u);
}

TEST_P(StandingLooksOf, WhatHasStoodIsFoundWhereEachCellSaysSo) {
  const auto [width, height] = GetParam();
  const Grid grid(width, height);
  const size_t cells = grid.cells();
  StandingLooks looks(grid);
  std::vector<float> background(kChannels * cells, 100), with_bag = background;
  // Single cells, far from each other: each is a region.
  std::vector<uint8_t> bag(cells);
  for (int row = 1; row < grid.rows; row += 4)
    for (int col = 1; col < grid.cols; col += 4) {
      const auto cell = static_cast<size_t>(row * grid.cols + col);
      bag[cell] = 1;
      for (size_t c = 0; c < kChannels; ++c) with_bag[c * cells + cell] = 150;
    }
  const auto planes_of = [&](const std::vector<float>& of) {
    return std::array<const float*, 3>{of.data(), of.data() + cells, of.data() + 2 * cells};
  };
  int64_t number = 0;
  for (; number < 30; ++number) looks.follow(planes_of(background).data(), kSameLight, number);
  for (; number < 100; ++number) {
    looks.follow(planes_of(with_bag).data(), kSameLight, number);
    const std::vector<int> stood = looks.stood(planes_of(background).data(), 50);
    std::vector<uint8_t> found(cells);
    for (int cell : stood) found[static_cast<size_t>(cell)] = 1;
    for (size_t cell = 0; cell < cells; ++cell) {
      if (!bag[cell]) continue;
      ASSERT_EQ(found[cell], number - 30 >= 50) << "frame " << number << ", cell " << cell;
    }
    ASSERT_EQ(stood.empty(), number - 30 < 50);
  }
  // Where the background has all bags but one, this one is found, with its neighbours; and not
  // while something passes in front of it.
  const auto first = static_cast<size_t>(grid.cols + 1);
  std::vector<float> known = with_bag;
  for (size_t c = 0; c < kChannels; ++c) known[c * cells + first] = 100;
  const std::vector<int> alone = looks.stood(planes_of(known).data(), 50);
  EXPECT_FALSE(alone.empty());
  for (int cell : alone) {
    EXPECT_LE(std::abs(cell / grid.cols - 1), 1) << cell;
    EXPECT_LE(std::abs(cell % grid.cols - 1), 1) << cell;
  }
  std::vector<float> passed = with_bag;
  for (size_t c = 0; c < kChannels; ++c) passed[c * cells + first] = 200;
  looks.follow(planes_of(passed).data(), kSameLight, number);
  EXPECT_TRUE(looks.stood(planes_of(known).data(), 50).empty());
}

// Cells that are hidden in 0, 1, 2, 3, 0, ... of five frames, each of which has its own light.
TEST_P(StandingLooksOf, WhatIsHiddenInMoreThanOneFrameIsLeftOut) {
  const auto [width, height] = GetParam();
  const Grid grid(width, height);
  StandingLooks looks(grid);
  const std::vector<float> level(grid.cells(), 100);
  const float* const frame[3] = {level.data(), level.data(), level.data()};
  for (int t = 0; t < StandingLooks::kSteady; ++t) looks.follow(frame, kSameLight, t);
  constexpr int kFrames = 5;
  GridFrames frames(grid, kFrames);
  std::array<LitSlot, kFrames> slots;
  for (int i = 0; i < kFrames; ++i) {
    const float light = 1 - 0.1f * static_cast<float>(i);
    slots[static_cast<size_t>(i)] = {kFrames - 1 - i, {light, light, light}};
    for (int c = 0; c < kChannels; ++c)
      for (int cell = 0; cell < static_cast<int>(grid.cells()); ++cell)
        frames.plane(kFrames - 1 - i, c)[cell] = light * (i < cell % 4 && c == 1 ? 113.f : 100.f);
  }
  std::vector<int> cells, expected;
  for (int cell = 0; cell < static_cast<int>(grid.cells()); cell += 3) {
    cells.push_back(cell);
    if (cell % 4 < 2) expected.push_back(cell);
  }
  looks.leave_out_hidden(frames, slots, &cells);
  EXPECT_EQ(cells, expected);
}

INSTANTIATE_TEST_SUITE_P(Grids, StandingLooksOf,
                         testing::Values(std::array{320, 240}, std::array{48, 48}, std::array{7, 5},
                                         std::array{353, 131}));

}  // namespace
}  // namespace qdmd::test
