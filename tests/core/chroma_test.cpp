// SPDX-License-Identifier: LGPL-2.1-or-later
// Samples that pixels share, against their definitions, on every instruction set of this machine.
#include "core/passes/chroma.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

constexpr uint8_t kCanary = 0x5A;
constexpr size_t kCounts[] = {1,  2,  3,  15, 16,  17,  18,  31,  32,  33,  34,  47,
                              63, 64, 65, 66, 127, 128, 129, 130, 131, 255, 256, 641};

std::mt19937 rng(2101);

void fill_randomly(BeforeTheEdge<uint8_t>& samples) {
  for (uint8_t& sample : samples) sample = static_cast<uint8_t>(rng() >> 9);
}

TEST(SpreadSamples, AnyCountAndStride) {
  on_every_target([] {
    for (size_t count : kCounts)
      for (ptrdiff_t stride : {1, 2, 3, 4, 6})
        for (int columns : {1, 2}) {
          const size_t samples =
              (count + static_cast<size_t>(columns) - 1) / static_cast<size_t>(columns);
          // The first sample is the first that may be read, and the last one the last.
          BeforeTheEdge<uint8_t> from((samples - 1) * static_cast<size_t>(stride) + 1), to(count);
          fill_randomly(from);
          spread_samples(from.data(), stride, columns, count, to.data());
          for (size_t p = 0; p < count; ++p)
            ASSERT_EQ(to[p], from[p / static_cast<size_t>(columns) * static_cast<size_t>(stride)])
                << p << " of " << count << ", " << stride << " apart, for " << columns;
        }
  });
}

TEST(SpreadSamples, BackwardsToo) {
  const std::vector<uint8_t> from = {9, 8, 7, 6, 5};
  std::vector<uint8_t> to(5);
  spread_samples(from.data() + 4, -2, 2, 5, to.data());
  EXPECT_EQ(to, (std::vector<uint8_t>{5, 5, 7, 7, 9}));
}

TEST(MeanOfPairs, RoundsHalvesUp) {
  on_every_target([] {
    for (size_t count : kCounts)
      for (bool two_rows : {false, true}) {
        BeforeTheEdge<uint8_t> above(count), below(count), out((count + 1) / 2);
        fill_randomly(above);
        fill_randomly(below);
        // Sums that need more than 8 bits.
        if (count > 5) above[0] = above[1] = below[0] = below[1] = 255;
        mean_of_pairs(above.data(), two_rows ? below.data() : nullptr, count, out.data());
        for (size_t k = 0; k < out.size(); ++k) {
          int sum = 0, samples = 0;
          for (size_t p = 2 * k; p < std::min(count, 2 * k + 2); ++p) {
            sum += above[p], ++samples;
            if (two_rows) sum += below[p], ++samples;
          }
          ASSERT_EQ(out[k], (sum + samples / 2) / samples) << k << " of " << count;
        }
      }
  });
}

TEST(Interleave, AnyCount) {
  on_every_target([] {
    for (size_t count : kCounts) {
      BeforeTheEdge<uint8_t> first(count), second(count), out(2 * count);
      fill_randomly(first);
      fill_randomly(second);
      interleave(first.data(), second.data(), count, out.data());
      for (size_t k = 0; k < count; ++k) {
        ASSERT_EQ(out[2 * k], first[k]) << k << " of " << count;
        ASSERT_EQ(out[2 * k + 1], second[k]) << k << " of " << count;
      }
    }
  });
}

TEST(FitLevels, OfEverySampleAndRange) {
  on_every_target([] {
    for (const auto& [black, white] :
         {std::pair{0, 255}, {16, 235}, {128, 128}, {0, 1}, {254, 255}, {16, 240}}) {
      BeforeTheEdge<uint8_t> x(256), out(256);
      for (size_t p = 0; p < 256; ++p) x[p] = static_cast<uint8_t>(p);
      fit_levels(x.data(), static_cast<uint8_t>(black), static_cast<uint8_t>(white), 256,
                 out.data());
      for (size_t p = 0; p < 256; ++p)
        ASSERT_EQ(out[p], black + std::lround((white - black) * static_cast<double>(p) / 255))
            << p << " in " << black << " to " << white;
    }
  });
}

TEST(FitLevels, OfAnyCount) {
  on_every_target([] {
    for (size_t count : {1, 2, 15, 16, 17, 31, 33, 63, 64, 65, 127, 200}) {
      BeforeTheEdge<uint8_t> x(count), out(count);
      for (size_t p = 0; p < count; ++p) x[p] = static_cast<uint8_t>(7 * p);
      fit_levels(x.data(), 16, 235, count, out.data());
      for (size_t p = 0; p < count; ++p)
        ASSERT_EQ(out[p], 16 + std::lround(219.0 * x[p] / 255)) << p << " of " << count;
    }
  });
}

TEST(ResidualLevels, OfEveryPairOfSamples) {
  on_every_target([] {
    for (const auto& [black, white] : {std::pair{0, 255}, {16, 235}, {128, 128}})
      for (int level = 0; level < 256; ++level) {
        BeforeTheEdge<uint8_t> x(256), l(256), out(256);
        for (size_t p = 0; p < 256; ++p)
          x[p] = static_cast<uint8_t>(p), l[p] = static_cast<uint8_t>(level);
        residual_levels(x.data(), l.data(), static_cast<uint8_t>(black),
                        static_cast<uint8_t>(white), 256, out.data());
        for (size_t p = 0; p < 256; ++p)
          ASSERT_EQ(out[p], std::min(black + std::abs(static_cast<int>(p) - level), white))
              << p << " - " << level;
      }
  });
}

TEST(AreAll, SeesOneThatDiffers) {
  on_every_target([] {
    for (size_t count : kCounts) {
      BeforeTheEdge<uint8_t> samples(count);
      std::fill(samples.begin(), samples.end(), kCanary);
      ASSERT_TRUE(are_all(samples.data(), kCanary, count));
      ASSERT_FALSE(are_all(samples.data(), kCanary ^ 1, count));
      for (size_t p = 0; p < count; ++p)
        for (int bit : {1, 128}) {
          samples[p] = static_cast<uint8_t>(kCanary ^ bit);
          ASSERT_FALSE(are_all(samples.data(), kCanary, count)) << p << " of " << count;
          samples[p] = kCanary;
        }
    }
  });
}

}  // namespace
}  // namespace qdmd::test
