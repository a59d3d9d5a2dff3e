// SPDX-License-Identifier: LGPL-2.1-or-later
// The passes behind masks, against their definitions.
#include "core/foreground/decision.h"
#include "core/foreground/mask_runs.h"
#include "core/foreground/specks.h"
#include "core/passes/distance.h"
#include "core/passes/mask.h"
#include "core/passes/mean_distance.h"
#include "core/passes/shading.h"
#include "tests/core/engine_util.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

// Rows of three channels with `margin` samples more on both sides, one after another before an
// inaccessible page.
struct Rows {
  Rows(size_t rows, size_t count, size_t margin, std::mt19937& rng)
      : step(count + 2 * margin), memory(3 * rows * step) {
    for (uint8_t& sample : memory) sample = static_cast<uint8_t>(rng() % 256);
    for (size_t i = 0; i < 3 * rows; ++i) at.push_back(memory.data() + i * step + margin);
  }
  size_t step;
  BeforeTheEdge<uint8_t> memory;
  std::vector<uint8_t*> at;

  const uint8_t* const* data() const { return const_cast<const uint8_t* const*>(at.data()); }
};

TEST(Distance, IsTheNearestOfThePixelsAround) {
  std::mt19937 rng(320);
  on_every_target([&] {
    for (size_t count : {1u, 2u, 15u, 16u, 33u, 64u, 257u})
      for (int step : {1, 4}) {
        Rows x(1, count, 0, rng), l(kPlacesAlong, count, static_cast<size_t>(kPlaces * step), rng);
        BeforeTheEdge<uint16_t> own(count), nearest(count);
        const uint8_t* const middle[3] = {l.at[kPlaces], l.at[kPlacesAlong + kPlaces],
                                          l.at[2 * kPlacesAlong + kPlaces]};
        squared_distance(x.data(), middle, count, own.data());
        nearest_distance(x.data(), l.data(), count, step, nearest.data());
        for (int p = 0; p < static_cast<int>(count); ++p) {
          int least = 65535;
          for (int row = 0; row < kPlacesAlong; ++row)
            for (int col = -kPlaces; col <= kPlaces; ++col) {
              int sum = 0;
              for (int c = 0; c < 3; ++c) {
                const int d =
                    x.at[size_t(c)][p] - l.at[size_t(c * kPlacesAlong + row)][p + col * step];
                sum += d * d;
              }
              least = std::min(least, sum);
              if (row == kPlaces && col == 0) {
                ASSERT_EQ(own[size_t(p)], std::min(sum, 65535)) << p << " of " << count;
              }
            }
          ASSERT_EQ(nearest[size_t(p)], least) << p << " of " << count;
        }
      }
  });
}

TEST(Shading, FollowsItsDefinition) {
  std::mt19937 rng(321);
  size_t shaded = 0, others = 0;
  LightRange other;
  other.darkest = 0.7f, other.brightest = 1.05f, other.of_level = 0.2f;
  other.alone = 0.8f, other.around = 0.6f, other.least_rest = 5;
  on_every_target([&] {
    for (size_t count : {1u, 2u, 7u, 16u, 27u, 28u})
      for (const auto& black : {std::array<uint8_t, 3>{0, 0, 0}, {16, 128, 128}}) {
        const LightRange range = rng() % 2 ? LightRange() : other;
        Rows l(kShadingAlong, count, kShadingReach, rng),
            x(kShadingAlong, count, kShadingReach, rng);
        // About the background in another light.
        const double gain = 0.4 + 0.001 * static_cast<double>(rng() % 900);
        for (size_t row = 0; row < l.at.size(); ++row)
          for (size_t i = 0; i < count + 2 * kShadingReach; ++i) {
            const int dark = black[row / kShadingAlong];
            const double lit = dark + gain * (l.at[row][i - kShadingReach] - dark);
            x.at[row][i - kShadingReach] = static_cast<uint8_t>(
                std::clamp(lit + static_cast<double>(rng() % 9) - 4, 0.0, 255.0));
          }
        Rows differing(kShadingAlong, count, kShadingReach, rng);
        for (uint8_t& sample : differing.memory) sample = sample % 4 ? 255 : 0;
        BeforeTheEdge<uint8_t> limit(count), asked(count), out(count);
        for (size_t p = 0; p < count; ++p) {
          limit[p] = static_cast<uint8_t>(rng() % 3 ? 4 + rng() % 20 : rng() % 256);
          asked[p] = rng() % 4 ? 255 : 0;
        }
        const ShadingRows rows = {{x.at[0], x.at[kShadingAlong], x.at[2 * kShadingAlong]},
                                  {l.at[0], l.at[kShadingAlong], l.at[2 * kShadingAlong]},
                                  differing.at[0],
                                  x.step,
                                  l.step};
        find_shaded(rows, black.data(), asked.data(), limit.data(), range, count, out.data());
        for (int p = 0; p < static_cast<int>(count); ++p) {
          // <x, L>, <L, L>, <x, x> of the pixel, and of those around.
          double own[3] = {}, around[3] = {};
          int pixels = 0;
          for (int row = 0; row < kShadingAlong; ++row)
            for (int col = -kShadingReach; col <= kShadingReach; ++col) {
              const bool differs = differing.at[size_t(row)][p + col] != 0;
              pixels += differs;
              for (int c = 0; c < 3; ++c) {
                const auto at = static_cast<size_t>(c * kShadingAlong + row);
                const double a = x.at[at][p + col] - black[size_t(c)];
                const double b = l.at[at][p + col] - black[size_t(c)];
                const double products[3] = {a * b, b * b, a * a};
                for (int k = 0; k < 3; ++k) {
                  if (differs) around[k] += products[k];
                  if (row == kShadingReach && col == 0) own[k] += products[k];
                }
              }
            }
          const auto rest = [](const double sums[3]) {
            return sums[2] - sums[0] * sums[0] / sums[1];
          };
          const double a = own[0] / own[1];
          const double least = double{range.least_rest};
          const double most = std::min(std::max(least, double{range.alone} * limit[size_t(p)]),
                                       double{range.of_level} * std::sqrt(own[1]));
          const double texture = std::max(least, double{range.around} * limit[size_t(p)]);
          // What floats round away decides nothing here.
          const double darkest = double{range.darkest}, brightest = double{range.brightest};
          if (std::abs(rest(own) - most * most) < 0.05 || std::abs(a - darkest) < 1e-5 ||
              std::abs(rest(around) / pixels - texture * texture) < 0.05 ||
              std::abs(a - brightest) < 1e-5)
            continue;
          const bool expected = asked[size_t(p)] && own[1] > 0 && a >= darkest && a <= brightest &&
                                rest(own) <= most * most &&
                                rest(around) <= pixels * texture * texture;
          ++(expected ? shaded : others);
          ASSERT_EQ(out[size_t(p)], expected ? 255 : 0) << p << " of " << count;
        }
      }
  });
  EXPECT_GT(shaded, 50u);
  EXPECT_GT(others, 50u);
}

TEST(Distance, OfMeansIsThatOfTheirPixels) {
  std::mt19937 rng(330);
  on_every_target([&] {
    for (size_t count : {1u, 2u, 15u, 33u, 257u, 600u}) {
      Rows x(3, count, 1, rng), l(3, count, 1, rng);
      BeforeTheEdge<uint16_t> out(count);
      smoothed_distance(x.data(), l.data(), count, out.data());
      for (int p = 0; p < static_cast<int>(count); ++p) {
        double squared = 0;
        for (int c = 0; c < 3; ++c) {
          int sum = 0;
          for (int row = 0; row < 3; ++row)
            for (int col = -1; col <= 1; ++col)
              sum += x.at[size_t(3 * c + row)][p + col] - l.at[size_t(3 * c + row)][p + col];
          squared += sum * sum / 81.0;
        }
        // Rounded to whole squared levels, from floats.
        ASSERT_NEAR(out[size_t(p)], std::min(squared, 65535.0), 0.51) << p << " of " << count;
      }
    }
  });
}

TEST(MeanDistance, IsLearntAndRaisesLimits) {
  std::mt19937 rng(331);
  on_every_target([&] {
    for (size_t count : {1u, 2u, 15u, 33u, 257u})
      for (float share : {1.0f, 0.125f, 0.02f}) {
        BeforeTheEdge<uint16_t> squared(count), mean(count);
        BeforeTheEdge<uint8_t> limit(count), mask(count);
        for (size_t p = 0; p < count; ++p) {
          squared[p] = static_cast<uint16_t>(rng() % 65536);
          mean[p] = static_cast<uint16_t>(rng() % 25601);
          limit[p] = static_cast<uint8_t>(rng() % 256);
          mask[p] = rng() % 2 ? 255 : 0;
        }
        const std::vector<uint16_t> before(mean.begin(), mean.end());
        learn_distance(squared.data(), count, share, mean.data());
        for (size_t p = 0; p < count; ++p) {
          const double distance =
              std::min<double>(std::sqrt(double(squared[p])), kMostMeanDistance);
          const double next = before[p] + double(share) * (256 * distance - before[p]);
          // Rounded, from floats.
          ASSERT_NEAR(mean[p], next, 0.51) << p;
        }
        const std::vector<uint8_t> limits(limit.begin(), limit.end()),
            masks(mask.begin(), mask.end());
        raise_limit(mean.data(), 896, count, limit.data());
        keep_beyond(squared.data(), limit.data(), count, mask.data());
        for (size_t p = 0; p < count; ++p) {
          ASSERT_EQ(limit[p], std::min(255, std::max<int>(limits[p], mean[p] * 896 / 65536))) << p;
          ASSERT_EQ(mask[p], squared[p] > limit[p] * limit[p] ? masks[p] : 0) << p;
        }
      }
  });
}

TEST(MeanDistance, FollowsBackgroundAndWhatComesForAMoment) {
  std::mt19937 rng(332);
  size_t calm = 0, moments = 0, others = 0;
  on_every_target([&] {
    for (size_t count : {1u, 2u, 15u, 33u, 257u})
      for (const NoiseRates& rates :
           {NoiseRates{896, 768, 0.125f, 0.25f}, NoiseRates{512, 300, 1, 0}}) {
        BeforeTheEdge<uint16_t> squared(count), mean(count);
        BeforeTheEdge<uint8_t> limit(count), near(count), now(count), before(count);
        for (size_t p = 0; p < count; ++p) {
          const auto distance = rng() % 200;
          squared[p] = static_cast<uint16_t>(distance * distance + rng() % 7);
          mean[p] = static_cast<uint16_t>(rng() % 25601);
          limit[p] = static_cast<uint8_t>(rng() % 256);
          now[p] = rng() % 2 ? 255 : 0;
          near[p] = now[p] || rng() % 3 == 0 ? 255 : 0;
          before[p] = rng() % 2 ? 255 : 0;
        }
        const std::vector<uint16_t> known(mean.begin(), mean.end());
        learn_noise(squared.data(), limit.data(), near.data(), now.data(), before.data(), rates,
                    count, mean.data());
        for (size_t p = 0; p < count; ++p) {
          const int most = std::min(255, std::max<int>(limit[p], known[p] * rates.factor / 65536));
          const int far = std::min(255, most * rates.most_of_moments / 256);
          double distance = std::sqrt(double(squared[p])), share = 0;
          if (!near[p] && squared[p] <= most * most) {
            share = double(rates.share), ++calm;
          } else if (now[p] && !before[p]) {
            share = double(rates.share_of_moments), ++moments;
            distance = std::min<double>(distance, far);
          } else {
            ++others;
          }
          distance = std::min<double>(distance, kMostMeanDistance);
          // Rounded, from floats.
          ASSERT_NEAR(mean[p], known[p] + share * (256 * distance - known[p]), 0.51) << p;
        }
      }
  });
  EXPECT_GT(calm, 50u);
  EXPECT_GT(moments, 50u);
  EXPECT_GT(others, 50u);
}

TEST(Specks, AreCountedByFlooding) {
  std::mt19937 rng(329);
  for (auto [width, height] : {std::pair{1, 1}, {40, 30}, {300, 3}, {2, 200}, {97, 64}})
    for (int share : {3, 50, 90})
      for (bool diagonal : {false, true})
        for (uint8_t colour : {uint8_t{255}, uint8_t{0}}) {
          // Squares of 10 pixels, so that there are runs for every 16 pixels at most.
          const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
          std::vector<uint8_t> mask(pixels), squares(10000);
          for (uint8_t& square : squares) square = rng() % 100 < unsigned(share) ? 255 : 0;
          for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
              mask[size_t(y * width + x)] = squares[size_t(y / 10 * 100 + x / 10)];
          for (size_t least : {0u, 110u, 350u, 100000u}) {
            auto expected = mask;
            std::vector<uint8_t> seen(pixels);
            for (size_t start = 0; start < pixels; ++start) {
              if (seen[start] || mask[start] != colour) continue;
              std::vector<size_t> part = {start};
              seen[start] = 1;
              for (size_t i = 0; i < part.size(); ++i)
                for (int dy = -1; dy <= 1; ++dy)
                  for (int dx = -1; dx <= 1; ++dx) {
                    const int x = static_cast<int>(part[i]) % width + dx;
                    const int y = static_cast<int>(part[i]) / width + dy;
                    if ((dx != 0 && dy != 0 && !diagonal) || x < 0 || y < 0 || x >= width ||
                        y >= height)
                      continue;
                    const auto at = static_cast<size_t>(y * width + x);
                    if (seen[at] || mask[at] != colour) continue;
                    seen[at] = 1;
                    part.push_back(at);
                  }
              if (part.size() < least)
                for (size_t at : part) expected[at] = static_cast<uint8_t>(~colour);
            }
            auto cleaned = mask;
            Specks specks(width, height);
            if (!specks.take_out(cleaned.data(), colour, least, diagonal)) {
              EXPECT_LT(width, 20) << "rows of a few pixels have many runs";
              continue;
            }
            ASSERT_EQ(cleaned, expected) << width << "x" << height << " " << share;
          }
        }
}

TEST(Specks, OfNoiseStay) {
  std::vector<uint8_t> mask(100 * 100);
  for (size_t p = 0; p < mask.size(); p += 2) mask[p] = 255;
  auto same = mask;
  EXPECT_FALSE(Specks(100, 100).take_out(same.data(), 255, 20, false));
  EXPECT_EQ(same, mask);
}

}  // namespace
}  // namespace qdmd::test
