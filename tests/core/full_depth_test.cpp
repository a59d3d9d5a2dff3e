// SPDX-License-Identifier: LGPL-2.1-or-later
// Masks of samples of more than 8 bits against the definition, a frame by itself. (Streams of them
// are in deep_test.cpp.)
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "core/foreground/decision.h"

namespace qdmd::test {
namespace {

// The threshold that the noise asks for, and pixels' own limits: what each says is of whole
// samples.
TEST(FullDepth, LimitsOfPixelsAreComparedWithWholeSamples) {
  constexpr int kWide = 131, kHigh = 9;
  constexpr size_t kAll = size_t{kWide} * kHigh;
  DecisionSteps steps;
  steps.smooth = steps.noise = steps.texture = steps.light = steps.vote = steps.specks = false;
  for (int depth : {10, 12, 16})
    for (double threshold : {18.0, 20.7}) {
      const int low_bits = depth - 8, unit = 1 << low_bits;
      std::mt19937 rng(41);
      std::vector<int> level(3 * kAll), sample(3 * kAll);
      std::vector<uint8_t> high[3], low[3], ground[3], limits(kAll);
      for (uint8_t& limit : limits) limit = static_cast<uint8_t>(10 + rng() % 20);
      for (size_t c = 0; c < 3; ++c) {
        for (auto* planes : {high, low, ground}) planes[c].resize(kAll);
        for (size_t p = 0; p < kAll; ++p) {
          const size_t i = c * kAll + p;
          level[i] = 60 * unit + static_cast<int>(rng() % static_cast<unsigned>(100 * unit));
          // Norms are around the limits, and some of them next to one.
          const int far = static_cast<int>(rng() % static_cast<unsigned>(40 * unit)) - 20 * unit;
          sample[i] = level[i] + far;
          if (p % 4 == 0) sample[i] = level[i] + (c == 0 ? limits[p] * unit + int(p % 3) - 1 : 0);
          high[c][p] = static_cast<uint8_t>(sample[i] >> low_bits);
          low[c][p] = static_cast<uint8_t>(sample[i] & (unit - 1));
        }
      }
      BackgroundModel model;
      model.set_depth(depth);
      model.freeze_as({8, {ground[0], ground[1], ground[2]}, {}}, nullptr, kAll);
      std::vector<float> levels(level.size());
      for (size_t i = 0; i < level.size(); ++i)
        levels[i] = static_cast<float>(level[i]) / static_cast<float>(unit);
      const float* const own[3] = {levels.data(), levels.data() + kAll, levels.data() + 2 * kAll};
      model.replace(0, kAll, own);
      model.set_time(0);
      Comparison frame = {{{high[0].data(), low[0].data()},
                           {high[1].data(), low[1].data()},
                           {high[2].data(), low[2].data()}},
                          &model,
                          threshold};
      frame.limits = limits.data();
      Decision decision(kWide, kHigh, Colours::rgb, steps);
      decision.decide(frame, nullptr);
      size_t foreground = 0;
      for (size_t p = 0; p < kAll; ++p) {
        int64_t squared = 0;
        for (size_t c = 0; c < 3; ++c) {
          const int64_t distance = sample[c * kAll + p] - level[c * kAll + p];
          squared += distance * distance;
        }
        const double limit = std::max<double>(threshold, limits[p]) * unit;
        const bool expected = static_cast<double>(squared) > limit * limit;
        ASSERT_EQ(decision.mask()[p] != 0, expected)
            << depth << " bits, pixel " << p << ": " << squared << ", limit " << limits[p];
        foreground += expected;
      }
      EXPECT_GT(foreground, kAll / 10);
      EXPECT_LT(foreground, 9 * kAll / 10);
    }
}

}  // namespace
}  // namespace qdmd::test
