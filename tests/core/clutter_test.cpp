// SPDX-License-Identifier: LGPL-2.1-or-later
// Looks are weighed by their colours: against the definition, and for what it is.
#include "core/learn/robust/clutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "core/learn/robust/contour.h"
#include "core/learn/robust/stable_frames.h"

namespace qdmd::test {
namespace {

// Looks with few colours, so that some come often and others never.
GridFrames random_frames(const Grid& grid, int count, unsigned seed) {
  GridFrames frames(grid, count);
  std::mt19937 rng(seed);
  for (int t = 0; t < count; ++t)
    for (int c = 0; c < kChannels; ++c)
      for (size_t cell = 0; cell < grid.cells(); ++cell)
        frames.plane(t, c)[cell] = static_cast<float>(rng() % 5) * 63.75f;
  return frames;
}

using Colour = std::array<int, 3>;
Colour colour_of(const GridFrames& frames, int t, size_t cell) {
  Colour colour;
  for (int c = 0; c < kChannels; ++c)
    colour[static_cast<size_t>(c)] = std::min(static_cast<int>(frames.plane(t, c)[cell]) / 32, 7);
  return colour;
}
bool differ(const GridFrames& frames, int s, int t, size_t cell) {
  double sum = 0;
  for (int c = 0; c < kChannels; ++c)
    sum += std::abs(frames.plane(s, c)[cell] - frames.plane(t, c)[cell]);
  return sum > 30;
}

// The ratio of how often a colour is seen in the background and in what moves, each colour once
// more than it was seen; at least e^-3 and at most e^3.
std::vector<double> plain_weights(const Grid& grid, const GridFrames& frames, int count,
                                  const std::vector<int>& from) {
  std::map<Colour, double> of_background, of_clutter;
  double all_of_background = 512, all_of_clutter = 512;
  for (size_t cell = 0; cell < grid.cells(); ++cell)
    for (int t = 0; t < count; ++t) {
      ++of_background[colour_of(frames, from[cell], cell)];
      ++all_of_background;
      if (!differ(frames, from[cell], t, cell)) continue;
      ++of_clutter[colour_of(frames, t, cell)];
      ++all_of_clutter;
    }
  std::vector<double> weights;
  for (int t = 0; t < frames.size(); ++t)
    for (int y = 0; y < grid.rows; ++y)
      for (int x = 0; x < grid.cols; ++x) {
        double sum = 0, cells = 0;
        for (int yy = std::max(0, y - 2); yy <= std::min(grid.rows - 1, y + 2); ++yy)
          for (int xx = std::max(0, x - 2); xx <= std::min(grid.cols - 1, x + 2); ++xx, ++cells) {
            const Colour colour = colour_of(frames, t, static_cast<size_t>(yy * grid.cols + xx));
            const double likelier = (of_background[colour] + 1) / all_of_background *
                                    all_of_clutter / (of_clutter[colour] + 1);
            sum += std::clamp(std::log(likelier), -3.0, 3.0);
          }
        weights.push_back(std::exp(sum / cells));
      }
  return weights;
}

TEST(Clutter, IsWeighedByItsColours) {
  Pool one(1), three(3);
  for (const auto& [width, height] : {std::pair{1, 1}, {5, 1}, {64, 48}, {200, 120}})
    for (int count : {1, 2, 9}) {
      const Grid grid(width, height);
      // One look more than frames: an earlier window's.
      const GridFrames frames = random_frames(grid, count + 1, 5);
      const GridPictures pictures(frames);
      std::mt19937 rng(6);
      std::vector<int> from(grid.cells());
      for (int& t : from) t = static_cast<int>(rng() % static_cast<unsigned>(count + 1));
      std::vector<float> density(grid.cells() * static_cast<size_t>(count + 1));
      for (float& d : density) d = static_cast<float>(rng() % 1000) / 100;
      const auto weights = plain_weights(grid, frames, count, from);
      ClutterColours alone(grid, pictures, count, &one), together(grid, pictures, count, &three);
      alone.learn(from);
      together.learn(from);
      const auto weighed = alone.weigh(density), by_three = together.weigh(density);
      ASSERT_EQ(weighed.size(), density.size());
      for (size_t i = 0; i < density.size(); ++i) {
        // 25 logarithms up to 3, added in single precision, and the rest: 100 roundings.
        const double expected = density[i] * weights[i];
        ASSERT_NEAR(weighed[i], expected, 100 * 6e-8 * 3 * expected + 1e-30) << i;
        ASSERT_EQ(weighed[i], by_three[i]);
      }
    }
}

// A street of grey blocks; over its left three quarters something green in most frames, elsewhere
// in each, but in the corner for three frames of five at the same place.
struct Street {
  Grid grid{160, 120};
  GridFrames frames;
  static constexpr int kCount = 40;
  int corner = grid.cols / 4;

  Street() : frames(grid, kCount) {
    std::mt19937 rng(7);
    std::vector<std::array<float, 3>> green(grid.cells());
    for (int t = 0; t < kCount; ++t) {
      if (t == 0 || t >= 24)
        for (auto& leaf : green)
          leaf = {20 + static_cast<float>(rng() % 40), 90 + static_cast<float>(rng() % 80), 30};
      for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.cols; ++x) {
          const auto cell = static_cast<size_t>(y * grid.cols + x);
          const bool rests = x < corner && y < corner;
          // Leaves are larger than a patch; those that move are other ones with each frame.
          const auto leaf = static_cast<unsigned>((y + 3 * (rests ? t / 24 * t : t)) / 8 * 7 +
                                                  (x + 5 * (rests ? t / 24 * t : t)) / 8 * 3);
          const bool hidden = x < 3 * grid.cols / 4 && (rests && t < 24 ? true : leaf % 3 != 0);
          for (int c = 0; c < kChannels; ++c)
            frames.plane(t, c)[cell] =
                hidden
                    ? green[rests && t < 24 ? cell
                                            : (cell + static_cast<size_t>(t) * 37) % grid.cells()]
                           [static_cast<size_t>(c)]
                    : street(cell);
        }
    }
  }
  float street(size_t cell) const {
    const auto y = static_cast<int>(cell) / grid.cols, x = static_cast<int>(cell) % grid.cols;
    return 150 + 30 * static_cast<float>((x / 6 + y / 6) % 3);
  }
};

// A part of the cells is unlike the background, and either no two frames share what they show
// there, or half of them do, as where there are two scenes.
TEST(Clutter, IsThereWhereMuchIsHiddenByWhatMoves) {
  Pool pool(2);
  const Grid grid(160, 120);
  for (int count : {5, 40})
    for (double share : {0.2, 0.4})
      for (bool moves : {false, true}) {
        GridFrames frames(grid, count + 1);
        const auto hidden = static_cast<size_t>(share * static_cast<double>(grid.cells()));
        const float shared = moves ? 1.0f : 1.0f + 0.5f * static_cast<float>(count);
        for (int t = 0; t < count; ++t)
          for (int c = 0; c < kChannels; ++c) std::fill_n(frames.plane(t, c), hidden, 90.0f);
        const std::vector<float> density(grid.cells() * static_cast<size_t>(count + 1), shared);
        const GridPictures pictures(frames);
        const ClutterColours colours(grid, pictures, count, &pool);
        EXPECT_EQ(colours.hides_much(density, std::vector<int>(grid.cells(), count)),
                  moves && share > 0.3)
            << count;
      }
}

// Most frames show one look of a corner, and it is not the background.
TEST(Clutter, ThatRestsIsNotTheBackground) {
  Pool pool(2);
  const Street street;
  const GridPictures pictures(street.frames);
  // The second solve finds a room that the first one emptied.
  StableFramesRoom room(street.grid, Street::kCount);
  const StableFrames first = find_stable_frames(street.grid, pictures, Street::kCount, nullptr,
                                                &pool, {}, &room),
                     found = find_stable_frames(street.grid, pictures, Street::kCount, nullptr,
                                                &pool, {}, &room);
  EXPECT_EQ(found.limit, first.limit);
  double wrong = 0, all = 0;
  for (int y = 0; y < street.corner; ++y)
    for (int x = 0; x < street.corner; ++x) {
      const auto cell = static_cast<size_t>(y * street.grid.cols + x);
      for (uint16_t t : found.of_cell[cell]) {
        wrong += std::abs(street.frames.plane(t, 2)[cell] - street.street(cell)) > 30 ? 1 : 0;
        ++all;
      }
    }
  EXPECT_GT(all, 0);
  EXPECT_LT(wrong / all, 0.05);
}

}  // namespace
}  // namespace qdmd::test
