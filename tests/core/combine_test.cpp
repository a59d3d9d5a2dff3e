// SPDX-License-Identifier: LGPL-2.1-or-later
// Combinations of planes and of pictures against sums in more digits, on every instruction set.
#include "core/passes/combine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/core/constants.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

constexpr double kFloatEpsilon = std::numeric_limits<float>::epsilon();

// ---- combine_planes ----

constexpr size_t kPlaneSize = 1216;  // 19 cache lines

struct Combination {
  size_t sums, planes;
  std::vector<double> rows;  // coefficient of sum k with plane j at k * planes + j
  std::vector<std::unique_ptr<BeforeTheEdge<uint8_t>>> samples;

  Combination(size_t sums_, size_t planes_, std::mt19937& rng)
      : sums(sums_), planes(planes_), rows(sums_ * planes_) {
    for (size_t j = 0; j < planes; ++j) {
      // Read to the end of the last cache line, and no further.
      samples.push_back(std::make_unique<BeforeTheEdge<uint8_t>>(kPlaneSize));
      for (uint8_t& sample : *samples.back()) sample = static_cast<uint8_t>(rng() >> 11);
    }
  }

  // As combine_planes takes them: groups of four sums.
  std::vector<double> grouped() const {
    std::vector<double> out((sums + 3) / 4 * 4 * planes);
    for (size_t k = 0; k < sums; ++k)
      for (size_t j = 0; j < planes; ++j)
        out[4 * (k / 4 * planes + j) + k % 4] = rows[k * planes + j];
    return out;
  }

  std::vector<std::vector<float>> run(size_t first, size_t count) const {
    std::vector<const uint8_t*> from;
    for (const auto& plane : samples) from.push_back(plane->data());
    std::vector<std::unique_ptr<BeforeTheEdge<float>>> out;
    std::vector<float*> to;
    for (size_t k = 0; k < sums; ++k) {
      out.push_back(std::make_unique<BeforeTheEdge<float>>(count));
      to.push_back(out.back()->data());
    }
    const auto coefficients = grouped();
    combine_planes(coefficients.data(), sums, from.data(), planes, first, count, to.data());
    std::vector<std::vector<float>> result;
    for (const auto& sum : out) result.emplace_back(sum->begin(), sum->end());
    return result;
  }

  // The sum and the sum of its terms' sizes.
  std::pair<long double, long double> exact(size_t k, size_t p) const {
    long double sum = 0, size = 0;
    for (size_t j = 0; j < planes; ++j) {
      const long double term = static_cast<long double>(rows[k * planes + j]) * (*samples[j])[p];
      sum += term;
      size += std::abs(term);
    }
    return {sum, size};
  }
};

constexpr size_t kRuns[] = {1, 15, 16, 17, 33, 63, 64, 65, 255, 1024};

TEST(CombinePlanes, IsTheSumRoundedOnce) {
  std::mt19937 rng(211);
  std::normal_distribution<double> normal;
  for (size_t sums : {1, 2, 3, 4, 5, 8, 9})
    for (size_t planes : {1, 2, 3, 30, 301}) {
      Combination combination(sums, planes, rng);
      for (double& c : combination.rows) c = normal(rng);
      on_every_target([&] {
        for (size_t first : {0, 64, 192})
          for (size_t count : kRuns) {
            if (planes == 301 && count != 255) continue;
            const auto out = combination.run(first, count);
            for (size_t k = 0; k < sums; ++k)
              for (size_t p = 0; p < count; ++p) {
                const auto [sum, size] = combination.exact(k, first + p);
                // A rounding for each product and sum in double, then one in float.
                const long double tolerance =
                    2 * static_cast<long double>(planes) * kEpsilon * size +
                    kFloatEpsilon / 2 * std::abs(sum);
                ASSERT_LE(std::abs(out[k][p] - sum), tolerance)
                    << sums << " sums of " << planes << " planes, pixel " << first << " + " << p;
              }
          }
      });
    }
}

TEST(CombinePlanes, WholeNumbersAreExact) {
  std::mt19937 rng(212);
  Combination combination(6, 40, rng);
  // Products below 2^34 and 40 of them: every partial sum is a whole number below 2^53.
  for (double& c : combination.rows)
    c = static_cast<double>(static_cast<int64_t>(rng() % (1u << 27)) - (1 << 26));
  on_every_target([&] {
    const auto out = combination.run(64, 1000);
    for (size_t k = 0; k < 6; ++k)
      for (size_t p = 0; p < 1000; ++p)
        ASSERT_EQ(out[k][p], static_cast<float>(combination.exact(k, 64 + p).first));
  });
}

TEST(CombinePlanes, LargeCoefficientsMayCancel) {
  std::mt19937 rng(213);
  Combination combination(1, 3, rng);
  std::copy(combination.samples[0]->begin(), combination.samples[0]->end(),
            combination.samples[1]->begin());
  // Two frames that are equal: what is left of 2^30 times their levels is the third.
  combination.rows = {0x1p30, -0x1p30, 0.25};
  on_every_target([&] {
    const auto out = combination.run(0, 1024);
    for (size_t p = 0; p < 1024; ++p)
      ASSERT_EQ(out[0][p], 0.25f * static_cast<float>((*combination.samples[2])[p]));
  });
}

TEST(CombinePlanes, ARunsBitsDoNotDependOnItsNeighbours) {
  std::mt19937 rng(214);
  std::normal_distribution<double> normal;
  Combination combination(5, 21, rng);
  for (double& c : combination.rows) c = normal(rng);
  on_every_target([&] {
    const auto whole = combination.run(0, 1024);
    for (size_t first = 0; first < 1024; first += 64)
      for (size_t count : {1, 7, 16, 33, 64, 65, 100}) {
        if (first + count > 1024) continue;
        const auto run = combination.run(first, count);
        for (size_t k = 0; k < 5; ++k)
          for (size_t p = 0; p < count; ++p) ASSERT_EQ(run[k][p], whole[k][first + p]);
      }
  });
}

// ---- levels_of ----

// Rows of pictures and weights; every picture ends at an inaccessible page.
struct Levels {
  size_t pictures, pixels;
  std::vector<float> weights;  // 3 x pictures
  std::vector<std::unique_ptr<BeforeTheEdge<float>>> samples;

  Levels(size_t pictures_, size_t pixels_)
      : pictures(pictures_), pixels(pixels_), weights(3 * pictures_) {
    for (size_t k = 0; k < pictures; ++k)
      samples.push_back(std::make_unique<BeforeTheEdge<float>>(pixels));
  }

  std::array<std::vector<uint8_t>, 3> run(size_t first, size_t count) const {
    std::vector<const float*> from;
    for (const auto& picture : samples) from.push_back(picture->data());
    std::vector<std::unique_ptr<BeforeTheEdge<uint8_t>>> out;
    for (int c = 0; c < 3; ++c) out.push_back(std::make_unique<BeforeTheEdge<uint8_t>>(count));
    uint8_t* const to[3] = {out[0]->data(), out[1]->data(), out[2]->data()};
    levels_of(weights.data(), from.data(), pictures, first, count, to);
    std::array<std::vector<uint8_t>, 3> result;
    for (size_t c = 0; c < 3; ++c) result[c].assign(out[c]->begin(), out[c]->end());
    return result;
  }
};

int level(double value) {
  return static_cast<int>(std::clamp(std::floor(value + 0.5), 0.0, 255.0));
}

TEST(LevelsOf, IsTheSumRoundedAndClamped) {
  std::mt19937 rng(215);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> sample(-100, 400);
  for (size_t pictures = 0; pictures <= 9; ++pictures) {
    Levels levels(pictures, kMaxRun);
    for (float& w : levels.weights) w = normal(rng);
    for (const auto& picture : levels.samples)
      for (float& s : *picture) s = sample(rng);
    on_every_target([&] {
      for (size_t count : kRuns) {
        const auto out = levels.run(0, count);
        for (size_t c = 0; c < 3; ++c)
          for (size_t p = 0; p < count; ++p) {
            double sum = 0, size = 0.5;
            for (size_t k = 0; k < pictures; ++k) {
              const double term =
                  double{levels.weights[c * pictures + k]} * (*levels.samples[k])[p];
              sum += term;
              size += std::abs(term);
            }
            // A rounding for each product and sum in float, the half's included.
            const double error = static_cast<double>(2 * pictures + 1) * kFloatEpsilon * size;
            ASSERT_GE(out[c][p], level(sum - error)) << pictures << " pictures, pixel " << p;
            ASSERT_LE(out[c][p], level(sum + error)) << pictures << " pictures, pixel " << p;
          }
      }
    });
  }
}

TEST(LevelsOf, NoPictureIsBlack) {
  const Levels levels(0, 100);
  on_every_target([&] {
    for (const auto& channel : levels.run(0, 100)) EXPECT_EQ(channel, std::vector<uint8_t>(100, 0));
  });
}

// One value at each position of a run.
void expect_level(float value, int expected) {
  for (size_t count : {1, 17}) {
    Levels levels(1, count);
    levels.weights = {1, 1, 1};
    for (size_t p = 0; p < count; ++p) {
      for (float& s : *levels.samples[0]) s = 77;
      (*levels.samples[0])[p] = value;
      for (const auto& channel : levels.run(0, count))
        for (size_t q = 0; q < count; ++q)
          ASSERT_EQ(channel[q], q == p ? expected : 77) << value << " at " << p << " of " << count;
    }
  }
}

TEST(LevelsOf, HalvesGoUp) {
  Levels levels(1, 3 * 255);
  levels.weights = {1, 1, 1};
  for (size_t n = 0; n < 255; ++n) {
    // Exact in float.
    const auto whole = static_cast<float>(n);
    (*levels.samples[0])[3 * n] = whole;
    (*levels.samples[0])[3 * n + 1] = whole + 0.4375f;
    (*levels.samples[0])[3 * n + 2] = whole + 0.5f;
  }
  on_every_target([&] {
    for (const auto& channel : levels.run(0, 3 * 255))
      for (size_t n = 0; n < 255; ++n) {
        ASSERT_EQ(channel[3 * n], n);
        ASSERT_EQ(channel[3 * n + 1], n);
        ASSERT_EQ(channel[3 * n + 2], n + 1);
      }
  });
}

TEST(LevelsOf, ClampsWhateverComes) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const float nan = std::nanf("");
  on_every_target([&] {
    for (float low : {-0.0f, -0.49f, -0.5f, -0.51f, -1.0f, -256.0f, -3e9f, -1e30f, -kInf, nan, -nan,
                      1e-40f, std::numeric_limits<float>::denorm_min()})
      expect_level(low, 0);
    for (float high : {254.5f, 255.0f, 255.49f, 255.5f, 256.0f, 65536.0f, 3e9f, 1e30f, kInf})
      expect_level(high, 255);
  });
}

TEST(LevelsOf, InfinityLessInfinityIsZero) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  on_every_target([&] {
    Levels levels(3, 40);
    levels.weights = {1, -1, 1, kInf, 1, 1, 1, 1, 1};
    for (float& s : *levels.samples[0]) s = kInf;
    for (float& s : *levels.samples[1]) s = kInf;
    for (float& s : *levels.samples[2]) s = 100;
    const auto out = levels.run(0, 40);
    EXPECT_EQ(out[0], std::vector<uint8_t>(40, 0)) << "inf - inf";
    EXPECT_EQ(out[1], std::vector<uint8_t>(40, 255)) << "inf";
    EXPECT_EQ(out[2], std::vector<uint8_t>(40, 255));
    for (float& s : *levels.samples[0]) s = 0;
    for (float& s : *levels.samples[1]) s = 0;
    EXPECT_EQ(levels.run(0, 40)[1], std::vector<uint8_t>(40, 0)) << "0 inf";
  });
}

TEST(LevelsOf, RunsThatBeginAnywhereGiveTheSameBits) {
  std::mt19937 rng(216);
  std::uniform_real_distribution<float> weight(-1, 1), sample(0, 255);
  for (size_t pictures : {1, 3, 4, 9}) {
    constexpr size_t kPixels = 700;
    Levels levels(pictures, kPixels);
    for (float& w : levels.weights) w = weight(rng);
    for (const auto& picture : levels.samples)
      for (float& s : *picture) s = sample(rng);
    // The last picture brings every red sum within a few roundings of a half, where the order of
    // the steps, or one rounding more, shows in the result.
    levels.weights[pictures - 1] = 1;
    for (size_t p = 0; p < kPixels; ++p) {
      double others = 0;
      for (size_t k = 0; k + 1 < pictures; ++k)
        others += double{levels.weights[k]} * (*levels.samples[k])[p];
      (*levels.samples[pictures - 1])[p] =
          static_cast<float>(static_cast<double>(20 + p % 200) + 0.5 - others);
    }
    on_every_target([&] {
      const auto whole = levels.run(0, kPixels);
      for (size_t first = 0; first < 40; ++first)
        for (size_t count : {1, 3, 8, 15, 17, 65, 600}) {
          const auto run = levels.run(first, count);
          for (size_t c = 0; c < 3; ++c)
            for (size_t p = 0; p < count; ++p)
              ASSERT_EQ(run[c][p], whole[c][first + p])
                  << pictures << " pictures, " << count << " from " << first;
        }
    });
  }
}

}  // namespace
}  // namespace qdmd::test
