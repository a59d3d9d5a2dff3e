// SPDX-License-Identifier: LGPL-2.1-or-later
// The curve of a camera that a gain does not explain: at cells, and in a stream's background.
#include <algorithm>
#include <cmath>
#include <random>

#include "core/learn/robust/light_curve.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

// A camera that compresses what is bright: the sample of so much light.
float sample_of(float light) { return 250 * (1 - std::exp(-light / 140)); }

// A scene in one light and in `more` times as much, a third of it hidden by other things then.
struct TwoLights {
  static constexpr size_t kCells = 3000;
  std::vector<float> before = std::vector<float>(kChannels * kCells), now = before, truth = before;
  const float* unit[kChannels] = {now.data(), now.data() + kCells, now.data() + 2 * kCells};

  TwoLights(float more, float (*camera)(float), bool grey = false) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> light(10, 260), other(0, 255);
    std::normal_distribution<float> noise(0, 1);
    for (size_t cell = 0; cell < kCells; ++cell) {
      const float of_grey = light(random);
      for (size_t c = 0; c < kChannels; ++c) {
        const float of = grey ? of_grey : light(random);
        const size_t i = c * kCells + cell;
        before[i] = camera(of) + noise(random);
        truth[i] = camera(more * of);
        now[i] = cell % 3 == 0 ? other(random) : truth[i] + noise(random);
      }
    }
  }
  // The gain that most cells share: any that is about right will do.
  static constexpr Gain kGain = {1 / 1.15f, 1 / 1.15f, 1 / 1.15f};
  double error(const LightCurve& curve, const Gain& gain) const {
    double sum = 0;
    for (size_t i = 0; i < truth.size(); ++i) {
      const float level = before[i] / gain[i / kCells];
      sum += static_cast<double>(std::abs(level + curve.at(i / kCells, level) - truth[i]));
    }
    return sum / static_cast<double>(truth.size());
  }
};

TEST(LightCurve, IsThatOfTheCamera) {
  for (const bool as_luma : {false, true}) {
    // What R, G and B have in common is all that luma knows.
    const TwoLights lights(1.35f, sample_of, as_luma);
    const LightCurve curve = LightCurve::between(lights.before.data(), TwoLights::kGain,
                                                 lights.unit, TwoLights::kCells, as_luma);
    ASSERT_EQ(curve.none(), false);
    // Noise in `before` is 1.15 times as much then, .9 of it on average.
    EXPECT_GT(lights.error({}, TwoLights::kGain), 6);
    EXPECT_LT(lights.error(curve, TwoLights::kGain), 1.5);
    for (size_t c = 0; c < kChannels; ++c)
      for (float level = 0; level < 254; ++level)
        EXPECT_GE(level + 1 + curve.at(c, level + 1), level + curve.at(c, level) - 0.01f);
  }
}

TEST(LightCurve, IsNoneWhereAGainIsEnough) {
  const TwoLights lights(1.15f, [](float light) { return 0.8f * light; });
  for (const bool as_luma : {false, true})
    EXPECT_TRUE(LightCurve::between(lights.before.data(), TwoLights::kGain, lights.unit,
                                    TwoLights::kCells, as_luma)
                    .none());
}

TEST(LightCurve, OfNothingIsNone) {
  const std::vector<float> dark(3 * 10, 0.0f), white(3 * 10, 255.0f);
  const float* const of_dark[3] = {dark.data(), dark.data(), dark.data()};
  const float* const of_white[3] = {white.data(), white.data(), white.data()};
  for (const size_t cells : {size_t{0}, size_t{1}, size_t{10}}) {
    EXPECT_TRUE(LightCurve::between(dark.data(), kSameLight, of_white, cells, false).none());
    EXPECT_TRUE(LightCurve::between(white.data(), kSameLight, of_dark, cells, true).none());
    EXPECT_TRUE(LightCurve::between(dark.data(), kSameLight, of_dark, cells, false).none());
  }
  LightCurve mean;
  mean.add({});
  mean.divide(1);
  EXPECT_TRUE(mean.none());
  EXPECT_EQ(mean.at(2, 255), 0);
}

// Somebody stands there while the exposure changes, and goes on standing: the place behind has the
// curve that all others show. In R, G and B, or as a grey scene in Y of 16 to 235.
struct HiddenPlace {
  static constexpr int kWidth = 160, kHeight = 120, kChange = 300, kFrames = 520, kShown = 500;
  static constexpr size_t kPixels = size_t{kWidth} * kHeight;
  static constexpr float kMore = 1.4f;
  size_t channels;
  float black, unit;
  std::vector<float> scene = std::vector<float>(3 * kPixels);
  Clip clip = Clip(kPixels, kFrames);

  explicit HiddenPlace(bool luma)
      : channels(luma ? 1 : 3), black(luma ? 16 : 0), unit(luma ? 219.0f / 255 : 1) {
    std::mt19937 random(9);
    std::uniform_real_distribution<float> level(20, 170);
    constexpr int kTile = 6, kCols = kWidth / kTile + 1, kRows = kHeight / kTile + 1;
    std::vector<float> tiles(3 * kCols * kRows);
    for (float& tile : tiles) tile = level(random);
    for (size_t i = 0; i < scene.size(); ++i) {
      const size_t p = i % kPixels, x = p % kWidth / kTile, y = p / kWidth / kTile;
      scene[i] = tiles[(i / kPixels * kRows + y) * kCols + x];
    }
    std::normal_distribution<float> noise(0, 1);
    for (int t = 0; t < kFrames; ++t) {
      auto& frame = clip.frames[static_cast<size_t>(t)];
      const float light = t < kChange ? 1 : kMore;
      for (size_t i = 0; i < frame.size(); ++i) {
        const float of = t >= kChange - 60 && is_hidden(i) ? 40 : scene[i];
        const float seen = std::max(0.0f, sample_of(light * of) + noise(random));
        frame[i] = i < channels * kPixels ? byte_of(black + unit * seen + 0.5f) : uint8_t{128};
      }
    }
  }
  // Between the tiles' borders: who stands just over whole tiles could be one that was uncovered.
  static bool is_hidden(size_t i) {
    const size_t x = i % kPixels % kWidth, y = i % kPixels / kWidth;
    return x >= 63 && x < 93 && y >= 45 && y < 105;
  }
  // The mean of what the place behind is off, if sample i of it has that level.
  template <typename LevelOf>
  double error(LevelOf level_of) const {
    double sum = 0, count = 0;
    for (size_t i = 0; i < channels * kPixels; ++i)
      if (is_hidden(i)) {
        sum += static_cast<double>(std::abs(level_of(i) - sample_of(kMore * scene[i])));
        ++count;
      }
    return sum / count;
  }
};

TEST(LightCurve, CarriesPlacesThatAreHidden) {
  for (const bool luma : {false, true}) {
    const HiddenPlace place(luma);
    EXPECT_GT(place.error([&](size_t i) { return 1.2f * sample_of(place.scene[i]); }), 5);
    for (const Mode mode : {Mode::batch, Mode::live})
      for (const int window : {25, 50, 100}) {
        EngineOptions options = robust_of(window);
        options.mode = mode;
        if (luma) {
          options.colours = Colours::yuv;
          options.levels = {{16, 128, 128}, {235, 128, 128}};
        }
        const auto pictures =
            run_engine(place.clip, HiddenPlace::kWidth, HiddenPlace::kHeight, options);
        const auto& shown = pictures[HiddenPlace::kShown];
        EXPECT_LT(place.error([&](size_t i) {
          return (static_cast<float>(shown[i]) - place.black) / place.unit;
        }),
                  1.5)
            << (luma ? "luma, " : "") << (mode == Mode::live ? "live, " : "") << window;
      }
  }
}

}  // namespace
}  // namespace qdmd::test
