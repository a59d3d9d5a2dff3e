// SPDX-License-Identifier: LGPL-2.1-or-later
// Pictures seen from a little beside against their definition, on every instruction set.
#include <cmath>
#include <random>
#include <vector>

#include "core/align/resampler.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

// Keys 1981, section VII.
double weight(double way) {
  const double t = std::abs(way);
  if (t < 1) return 4.0 / 3 * t * t * t - 7.0 / 3 * t * t + 1;
  if (t < 2) return -7.0 / 12 * t * t * t + 3 * t * t - 59.0 / 12 * t + 2.5;
  if (t < 3) return 1.0 / 12 * t * t * t - 2.0 / 3 * t * t + 21.0 / 12 * t - 1.5;
  return 0;
}

struct Case {
  int width, height;
  Places places;
  int low_bits = 0;  // of samples, below their highest eight

  int most() const { return (256 << low_bits) - 1; }
};

constexpr uint8_t kOutside = 99, kLowOutside = 1;

// First along rows, at the row's own places, and then along columns.
double plain(const Case& at, const std::vector<int>& from, int x, int y, bool* inside,
             bool* border) {
  const Places& p = at.places;
  const double u = p.x0 + double{p.xx} * x + double{p.xy} * y;
  const double v = p.y0 + double{p.yx} * x + double{p.yy} * y;
  // Nobody knows what is next to the border, but for shifts.
  const double near = p.is_shift() ? 0 : 1e-3;
  *inside = u >= 0 && u <= at.width - 1 && v >= 0 && v <= at.height - 1;
  *border = std::min({std::abs(u), std::abs(u - at.width + 1), std::abs(v),
                      std::abs(v - at.height + 1)}) < near;
  double sum = 0;
  for (int row = static_cast<int>(std::floor(v)) - 2; row <= std::floor(v) + 3; ++row) {
    // Where column x meets this row of the picture.
    const double along = (double(row) - double{p.y0} - double{p.yx} * x) / double{p.yy};
    const double at_row = p.x0 + double{p.xx} * x + double{p.xy} * along;
    double of_row = 0;
    for (int col = static_cast<int>(std::floor(at_row)) - 2; col <= std::floor(at_row) + 3; ++col)
      of_row += weight(at_row - col) * from[static_cast<size_t>(std::clamp(row, 0, at.height - 1)) *
                                                static_cast<size_t>(at.width) +
                                            static_cast<size_t>(std::clamp(col, 0, at.width - 1))];
    sum += weight(v - row) * of_row;
  }
  return std::clamp(sum, 0.0, double(at.most()));
}

void expect_plain(const Case& at) {
  const auto pixels = static_cast<size_t>(at.width) * static_cast<size_t>(at.height);
  std::mt19937 rng(5);
  BeforeTheEdge<uint8_t> from(pixels), to(pixels), from_low(pixels), to_low(pixels);
  std::vector<int> samples(pixels);
  for (size_t p = 0; p < pixels; ++p) {
    samples[p] = static_cast<int>(rng() >> 13) & at.most();
    from.data()[p] = static_cast<uint8_t>(samples[p] >> at.low_bits);
    from_low.data()[p] = static_cast<uint8_t>(samples[p] & ((1 << at.low_bits) - 1));
  }
  std::fill(to.begin(), to.end(), kOutside);
  std::fill(to_low.begin(), to_low.end(), kLowOutside);
  Resampling task;
  task.depth = 8 + at.low_bits;
  task.from = {from.data(), at.low_bits > 0 ? from_low.data() : nullptr};
  task.from_width = task.width = at.width;
  task.from_height = task.height = at.height;
  task.places = at.places;
  task.to = {to.data(), at.low_bits > 0 ? to_low.data() : nullptr};
  ResampleRoom room;
  // In bands, as threads do.
  for (int first = 0; first < at.height; first += 37)
    resample(task, first, std::min(37, at.height - first), &room);
  for (int y = 0; y < at.height; ++y)
    for (int x = 0; x < at.width; ++x) {
      bool inside, border;
      const double expected = plain(at, samples, x, y, &inside, &border);
      if (border) continue;
      const size_t p =
          static_cast<size_t>(y) * static_cast<size_t>(at.width) + static_cast<size_t>(x);
      const int got = to.data()[p] << at.low_bits | (at.low_bits > 0 ? to_low.data()[p] : 0);
      const int outside = kOutside << at.low_bits | (at.low_bits > 0 ? kLowOutside : 0);
      // Half a unit to round, and twelve weights and sums in float; but for shifts places in float,
      // too: 2000 pixels times the epsilon, times a slope of two pictures' range.
      const double range = at.most() + 1, sums = 24 * 6e-8 * 2 * range;
      const double bound = 0.5 + sums + (at.places.is_shift() ? 0 : 2000 * 1.2e-7 * 4 * 2 * range);
      if (inside)
        ASSERT_NEAR(got, expected, bound)
            << at.width << "x" << at.height << " at " << x << ", " << y;
      else
        ASSERT_EQ(got, outside) << at.width << "x" << at.height << " at " << x << ", " << y;
    }
}

TEST(Resample, IsTheConvolutionWhereverItFalls) {
  on_every_target([] {
    for (const auto& [width, height] :
         {std::pair{1, 1}, {2, 3}, {7, 5}, {33, 64}, {257, 70}, {600, 40}})
      for (const Places& places :
           {Places{1, 0, 2.25f, 0, 1, -1.75f}, Places{1, 0, -0.5f, 0, 1, 0.5f},
            Places{1, 0, 3, 0, 1, -2}, Places{0.9994f, -0.0349f, 6.3f, 0.0349f, 0.9994f, -9.1f},
            Places{1.01f, 0.0175f, -3.2f, -0.0175f, 1.01f, 4.6f},
            Places{0.98f, -0.05f, 0.3f, 0.05f, 0.98f, 0.1f}})
        for (int low_bits : {0, 2, 8}) expect_plain({width, height, places, low_bits});
  });
}

TEST(Resample, AtRestIsTheSamePicture) {
  on_every_target([] {
    std::mt19937 rng(6);
    std::vector<uint8_t> from(301 * 77), to(from.size(), kOutside);
    for (uint8_t& sample : from) sample = static_cast<uint8_t>(rng() >> 13);
    Resampler resampler;
    resampler.prepare(nullptr);
    const Affine rest = affine(Pose(), middle_of(301, 77));
    resampler.run(from.data(), 8, rest, to.data(), 301, 77, nullptr);
    EXPECT_EQ(from, to);
    const std::vector<uint8_t> low(from.rbegin(), from.rend());
    std::vector<uint8_t> deep(from.size(), kOutside), deep_low(deep);
    resampler.run({from.data(), low.data()}, 16, rest, {deep.data(), deep_low.data()}, 301, 77,
                  nullptr);
    EXPECT_EQ(from, deep);
    EXPECT_EQ(low, deep_low);
  });
}

TEST(Resample, IsTheSameForAnyNumberOfThreads) {
  std::mt19937 rng(7);
  std::vector<uint8_t> from(320 * 240), alone(from.size(), 0), together(from.size(), 0);
  for (uint8_t& sample : from) sample = static_cast<uint8_t>(rng() >> 13);
  const Affine place = affine({3.3, -2.2, 0.02, 1.01}, middle_of(320, 240));
  Pool pool(3);
  Resampler resampler;
  resampler.prepare(&pool);
  resampler.run(from.data(), 8, place, alone.data(), 320, 240, nullptr);
  resampler.run(from.data(), 8, place, together.data(), 320, 240, &pool);
  EXPECT_EQ(alone, together);
}

TEST(Resample, FarAwayNothingIsWritten) {
  const std::vector<uint8_t> from(64 * 48, 7);
  std::vector<uint8_t> to(from.size(), kOutside);
  Resampler resampler;
  resampler.prepare(nullptr);
  for (const Pose& pose : {Pose{1e6, 0, 0, 1}, Pose{0, -1e6, 0, 1}, Pose{-1e4, 1e4, 0.02, 1}})
    resampler.run(from.data(), 8, affine(pose, middle_of(64, 48)), to.data(), 64, 48, nullptr);
  EXPECT_EQ(to, std::vector<uint8_t>(to.size(), kOutside));
}

}  // namespace
}  // namespace qdmd::test
