// SPDX-License-Identifier: LGPL-2.1-or-later
// Light as cameras have it: samples at the end of their range, exposure that swings or is looked
// for, and colours that go; and what they are told by.
#include <algorithm>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <tuple>

#include "core/foreground/grey.h"
#include "core/learn/robust/colour_map.h"
#include "core/learn/robust/exposure_watch.h"
#include "core/learn/robust/light.h"
#include "core/passes/rgb_colours.h"
#include "core/passes/unit_light.h"
#include "core/scene/scene.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

// ---- Bounds ----

TEST(ClippedSamples, AreBounds) {
  const Gain bright = {1.5f, 1.5f, 1.5f};
  const std::array<float, 3> wall = {200, 120, 90};
  // 300 is more than there can be.
  EXPECT_TRUE(may_show({255, 180, 135}, wall, bright));
  EXPECT_EQ(unclipped({255, 180, 135}, wall, bright), (std::array<float, 3>{300, 180, 135}));
  // A channel that is no bound says that something else is there.
  EXPECT_FALSE(may_show({255, 60, 135}, wall, bright));
  EXPECT_EQ(unclipped({255, 60, 135}, wall, bright), (std::array<float, 3>{255, 60, 135}));
  // What is darker than it would be is no bound either.
  EXPECT_FALSE(may_show({150, 180, 135}, wall, bright));
  // White paving in less light: it is at least so bright.
  const Gain dark = {0.8f, 0.8f, 0.8f};
  EXPECT_TRUE(may_show({255, 255, 255}, {255, 255, 255}, dark));
  EXPECT_TRUE(may_show({230, 230, 230}, {255, 255, 255}, dark));
  EXPECT_FALSE(may_show({120, 120, 120}, {255, 255, 255}, dark));
}

// Random cells, of which many are bright, under a light that swings.
TEST(ClippedSamples, LeaveTheGainsRight) {
  const Grid grid = grid_of(20, 30);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> level(30, 230);
  std::normal_distribution<float> noise(0, 1);
  std::vector<float> scene(3 * grid.cells());
  for (float& sample : scene) sample = level(random);
  constexpr int kFrames = 60;
  GridFrames frames(grid, kFrames);
  const auto truth = [](int t) {
    return 1.4f + 0.5f * std::sin(2 * std::numbers::pi_v<float> * static_cast<float>(t) / 40);
  };
  for (int t = 0; t < kFrames; ++t)
    for (int c = 0; c < 3; ++c)
      for (size_t i = 0; i < grid.cells(); ++i)
        frames.plane(t, c)[i] =
            std::clamp(scene[static_cast<size_t>(c) * grid.cells() + i] * truth(t) + noise(random),
                       0.0f, 255.0f);
  GridFrames median;
  const WindowLight light = light_of(frames, kFrames, nullptr, &median);
  EXPECT_TRUE(light.clips);
  const float unit = truth(30) / light.gains[30][0];
  for (int t = 0; t < kFrames; ++t)
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(light.gains[static_cast<size_t>(t)][c] * unit / truth(t), 1, 0.02) << t;
  // What is behind clipped samples is known from the darker frames, whose light is 1.
  EXPECT_LT(unit, 1.1f);
  for (int c = 0; c < 3; ++c)
    for (size_t i = 0; i < grid.cells(); ++i)
      EXPECT_NEAR(median.plane(0, c)[i], scene[static_cast<size_t>(c) * grid.cells() + i] * unit,
                  6);
}

TEST(ClippedSamples, WhiteThatStaysIsNoSwing) {
  const Grid grid = grid_of(12, 16);
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 1);
  GridFrames frames(grid, 30);
  for (int t = 0; t < 30; ++t)
    for (int c = 0; c < 3; ++c)
      for (size_t i = 0; i < grid.cells(); ++i)
        frames.plane(t, c)[i] = i % 3 == 0 ? 255 : 100 + static_cast<float>(i % 50) + noise(random);
  const WindowLight light = light_of(frames, 30);
  EXPECT_FALSE(light.clips);
  for (const Gain& gain : light.gains) EXPECT_EQ(gain, kSameLight);
}

// ---- Y, U and V ----

// R, G and B as Y, U and V of ITU-R BT.601 in 16 .. 235.
std::array<float, 3> yuv_of(float r, float g, float b) {
  const float y = 0.299f * r + 0.587f * g + 0.114f * b;
  return {16 + 219 / 255.0f * y, 128 + 112 / 255.0f / 0.886f * (b - y),
          128 + 112 / 255.0f / 0.701f * (r - y)};
}
constexpr Levels kVideo = {{16, 128, 128}, {235, 128, 128}};

TEST(RgbColours, AreThoseOfTheStandard) {
  const RgbColours video(Colours::yuv, kVideo);
  for (const float r : {0.0f, 40.0f, 255.0f})
    for (const float g : {0.0f, 150.0f, 255.0f})
      for (const float b : {0.0f, 90.0f, 255.0f}) {
        const auto yuv = yuv_of(r, g, b);
        const auto rgb = video.rgb(yuv), back = video.sample({r, g, b});
        // The standard's matrices have six digits.
        const std::array<float, 3> truth = {r, g, b};
        for (size_t c = 0; c < 3; ++c) {
          EXPECT_NEAR(rgb[c], truth[c], 1e-3 * 255);
          EXPECT_NEAR(back[c], yuv[c], 1e-3 * 255);
        }
      }
  EXPECT_FALSE(RgbColours(Colours::rgb, {}).converts());
  EXPECT_EQ(RgbColours(Colours::grey, {}).rgb({1, 2, 3}), (std::array<float, 3>{1, 2, 3}));
}

// A saturated wall in more light: its R ends, and the samples are those of what is left.
TEST(RgbColours, EndWhereTheSensorDoes) {
  const RgbColours video(Colours::yuv, kVideo);
  auto bright = yuv_of(1.5f * 220, 1.5f * 90, 1.5f * 60);
  float* const rows[3] = {&bright[0], &bright[1], &bright[2]};
  video.clip(1, rows);
  const auto truth = yuv_of(255, 135, 90);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(bright[c], truth[c], 0.3);

  // Known at the end, and seen in 0.8 of the light: R is at least 204, whatever it is beyond.
  const auto sample = [](const std::array<float, 3>& of) {
    return std::array<uint8_t, 3>{byte_of(of[0]), byte_of(of[1]), byte_of(of[2])};
  };
  auto known = sample(yuv_of(0.8f * 255, 0.8f * 100, 0.8f * 60));
  const auto seen = sample(yuv_of(240, 80, 48)), darker = sample(yuv_of(150, 80, 48));
  uint8_t* const level[3] = {&known[0], &known[1], &known[2]};
  const auto before = known;
  const auto raise = [&](const std::array<uint8_t, 3>& by) {
    known = before;
    const uint8_t* const x[3] = {&by[0], &by[1], &by[2]};
    video.raise_ends(1, 245, {0.8f, 0.8f, 0.8f}, x, level);
  };
  raise(seen);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(known[c], seen[c], 2);
  raise(darker);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(known[c], before[c], 1);
}

// Black and what has no colour stay in any light, and white is the end.
TEST(SampleLights, LeaveWhatIsDark) {
  const SampleRange range = kVideo.range();
  EXPECT_EQ(range.least, (std::array<uint8_t, 3>{16, 16, 16}));
  EXPECT_EQ(range.most, (std::array<uint8_t, 3>{235, 240, 240}));
  const SampleLight light({2, 2, 2}, range);
  EXPECT_EQ(in_light(16, light.into(0)), 16);
  EXPECT_EQ(in_light(66, light.into(0)), 116);
  EXPECT_EQ(in_light(200, light.into(0)), 235);
  EXPECT_EQ(in_light(128, light.into(1)), 128);
  EXPECT_EQ(in_light(118, light.into(1)), 108);
  EXPECT_EQ(out_of_light(116, light, 0), 66);
  EXPECT_EQ(out_of_light(108, light, 2), 118);
  // Full range, and R, G and B: all bytes.
  EXPECT_EQ(Levels{}.range().most, (std::array<uint8_t, 3>{255, 255, 255}));
  const Levels full = {{0, 128, 128}, {255, 128, 128}};
  EXPECT_EQ(full.range().least, (std::array<uint8_t, 3>{0, 0, 0}));
  EXPECT_EQ(full.range().dark, (std::array<uint8_t, 3>{0, 128, 128}));
}

// White balance in Y, U and V: exact for a middle grey.
TEST(SampleLights, TintWhatIsGrey) {
  const RgbColours video(Colours::yuv, kVideo);
  const Gain warm = {1.15f, 1, 0.85f};
  const SampleLight light(warm, video.range(kVideo));
  const auto grey = yuv_of(110, 110, 110), seen = yuv_of(1.15f * 110, 110, 0.85f * 110);
  for (size_t c = 0; c < 3; ++c) {
    const uint8_t now = in_light(byte_of(grey[c]), light.into(c));
    EXPECT_NEAR(now, seen[c], 1.5) << c;
    EXPECT_NEAR(out_of_light(now, light, c), grey[c], 1.5) << c;
  }
  EXPECT_TRUE(light.changes());
  // Without colours of its own, light is one gain.
  const SampleLight white({1.3f, 1.3f, 1.3f}, video.range(kVideo));
  EXPECT_EQ(white.tint, (std::array<float, 3>{}));
  EXPECT_EQ(white.gain, (Gain{1.3f, 1.3f, 1.3f}));
  EXPECT_FALSE(SampleLight(kSameLight, video.range(kVideo)).changes());
  // R, G and B have gains of their own.
  EXPECT_EQ(SampleLight(warm, RgbColours().range({})).gain, warm);
}

// Colours of light that change little are noise.
TEST(SampleLights, SmallTintsAreNone) {
  const Gain little = without_tint({1.03f, 1, 0.97f}), much = without_tint({1.15f, 1, 0.85f});
  for (const float of_channel : little) EXPECT_NEAR(of_channel, luma_gain({1.03f, 1, 0.97f}), 1e-6);
  EXPECT_NEAR(much[0], 1.15f, 0.01);
  EXPECT_NEAR(much[2], 0.85f, 0.01);
}

// ---- Colours ----

TEST(Grey, IsToldByTheContent) {
  constexpr size_t kWidth = 120, kHeight = 90;
  constexpr uint8_t kBlack[3] = {0, 0, 0}, kNeutral[3] = {16, 128, 128};
  std::mt19937 random(7);
  std::vector<uint8_t> planes[3];
  for (auto& plane : planes) plane.resize(kWidth * kHeight);
  const uint8_t* const x[3] = {planes[0].data(), planes[1].data(), planes[2].data()};
  for (size_t p = 0; p < kWidth * kHeight; ++p) {
    const auto level = static_cast<uint8_t>(20 + random() % 200);
    for (size_t c = 0; c < 3; ++c)
      planes[c][p] = static_cast<uint8_t>(level + static_cast<uint8_t>(random() % 3));
  }
  EXPECT_TRUE(is_grey(x, kWidth, kHeight, Colours::rgb, kBlack));
  EXPECT_FALSE(is_grey(x, kWidth, kHeight, Colours::yuv, kNeutral));
  for (size_t c : {1, 2}) std::fill(planes[c].begin(), planes[c].end(), uint8_t{128});
  EXPECT_TRUE(is_grey(x, kWidth, kHeight, Colours::yuv, kNeutral));
  EXPECT_FALSE(is_grey(x, kWidth, kHeight, Colours::rgb, kBlack));
  EXPECT_TRUE(is_grey(x, kWidth, kHeight, Colours::grey, kBlack));
  // A red lamp in a grey picture.
  for (size_t y = 0; y < 30; ++y)
    std::fill_n(planes[2].begin() + static_cast<ptrdiff_t>(y * kWidth), 30, uint8_t{200});
  EXPECT_FALSE(is_grey(x, kWidth, kHeight, Colours::yuv, kNeutral));
}

TEST(ColourMaps, InfraRedIsFoundBehindPeople) {
  constexpr size_t kCells = 600;
  std::mt19937 random(9);
  std::uniform_real_distribution<float> level(10, 230);
  std::normal_distribution<float> noise(0, 1);
  std::vector<float> scene[3], frame[3];
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < kCells; ++i) scene[c].push_back(level(random));
    frame[c].resize(kCells);
  }
  const float weight[3] = {0.34f, 0.6f, 0.13f};
  for (size_t i = 0; i < kCells; ++i) {
    float luma = 4 + noise(random);
    for (size_t c = 0; c < 3; ++c) luma += weight[c] * scene[c][i];
    // A fifth is hidden.
    if (i < kCells / 5) luma = 30;
    for (size_t c = 0; c < 3; ++c) frame[c][i] = luma;
  }
  const float* const before[3] = {scene[0].data(), scene[1].data(), scene[2].data()};
  const float* const now[3] = {frame[0].data(), frame[1].data(), frame[2].data()};
  EXPECT_EQ(colouring_of(before, nullptr, kCells), Colouring::some);
  EXPECT_EQ(colouring_of(now, nullptr, kCells), Colouring::none);
  const auto map = find_colour_map(now, before, kCells);
  ASSERT_TRUE(map);
  for (const auto& row : map->row) {
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(row[c], weight[c], 0.01);
    EXPECT_NEAR(row[3], 4, 2);
  }
  // Nothing explains another picture.
  for (size_t c = 0; c < 3; ++c)
    for (float& sample : frame[c]) sample = level(random);
  EXPECT_FALSE(find_colour_map(now, before, kCells));
  // One colour has a map, too.
  for (size_t c = 0; c < 3; ++c) {
    std::fill(scene[c].begin(), scene[c].end(), 50.0f + 30 * static_cast<float>(c));
    std::fill(frame[c].begin(), frame[c].end(), 90.0f);
  }
  ASSERT_TRUE(find_colour_map(now, before, kCells));
  EXPECT_NEAR(find_colour_map(now, before, kCells)->of({50, 80, 110})[1], 90, 1);
}

// White paving in the sun: most samples are at the end of their range, and have lost their colour.
TEST(ColourMaps, WhatIsTooBrightSaysNothing) {
  constexpr size_t kCells = 600;
  std::mt19937 random(9);
  std::uniform_real_distribution<float> level(10, 130);
  std::vector<float> scene[3], frame[3];
  for (size_t i = 0; i < kCells; ++i) {
    const float paving = i < kCells / 2 ? 110 : 0;
    for (size_t c = 0; c < 3; ++c) scene[c].push_back(paving + level(random));
  }
  for (auto& plane : frame) plane.resize(kCells);
  const float* const before[3] = {scene[0].data(), scene[1].data(), scene[2].data()};
  const float* const now[3] = {frame[0].data(), frame[1].data(), frame[2].data()};
  // Twice as bright it is as coloured as it was.
  for (size_t c = 0; c < 3; ++c)
    for (size_t i = 0; i < kCells; ++i) frame[c][i] = std::min(255.0f, 2 * scene[c][i]);
  EXPECT_EQ(colouring_of(now, before, kCells), Colouring::some);
  EXPECT_EQ(colouring_of(before, now, kCells), Colouring::some);
  // All white: nobody knows.
  for (size_t c = 0; c < 3; ++c) std::fill(frame[c].begin(), frame[c].end(), 255.0f);
  EXPECT_EQ(colouring_of(now, before, kCells), Colouring::little);
  // Without colour, and so bright that a third is at the end: the map is that of the rest.
  const float weight[3] = {0.5f, 0.9f, 0.2f};
  size_t at_end = 0;
  for (size_t i = 0; i < kCells; ++i) {
    float luma = 0;
    for (size_t c = 0; c < 3; ++c) luma += weight[c] * scene[c][i];
    at_end += luma > 255;
    for (size_t c = 0; c < 3; ++c) frame[c][i] = std::min(255.0f, luma);
  }
  EXPECT_GT(at_end, kCells / 4);
  EXPECT_EQ(colouring_of(now, before, kCells), Colouring::none);
  const auto map = find_colour_map(now, before, kCells);
  ASSERT_TRUE(map);
  for (const auto& row : map->row) {
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(row[c], weight[c], 0.01);
    EXPECT_NEAR(row[3], 0, 1);
  }
  // What becomes too bright ends where the samples' range does.
  ColourMap twice = {};
  for (size_t c = 0; c < 3; ++c) twice.row[c][c] = 2;
  const auto recoloured = [&](const SampleRange& range) {
    uint8_t of[3][2] = {{60, 130}, {60, 130}, {2, 130}};
    uint8_t* const levels[3] = {of[0], of[1], of[2]};
    recolour(twice, range, 2, levels);
    return std::array<int, 6>{of[0][0], of[0][1], of[1][0], of[1][1], of[2][0], of[2][1]};
  };
  EXPECT_EQ(recoloured({}), (std::array<int, 6>{120, 255, 120, 255, 4, 255}));
  EXPECT_EQ(recoloured(kVideo.range()), (std::array<int, 6>{120, 235, 120, 240, 16, 240}));
}

// ---- The exposure of a camera that starts ----

TEST(ExposureWatch, WaitsUntilTheLightRests) {
  const auto settles = [](const std::function<float(int)>& mean) {
    ExposureWatch watch;
    std::vector<float> plane(16);
    const float* const cells[3] = {plane.data(), plane.data(), plane.data()};
    for (int t = 0; t < 1000; ++t) {
      std::fill(plane.begin(), plane.end(), mean(t));
      watch.follow(cells, plane.size());
      if (watch.settled()) return std::pair{t, watch.has_found()};
    }
    return std::pair{-1, false};
  };
  EXPECT_EQ(settles([](int) { return 90.0f; }), (std::pair{9, false}));
  // Black for two seconds, and then brighter than it will be.
  const auto start = settles([](int t) {
    return t < 50 ? 4.0f : t < 125 ? 200 - static_cast<float>(t - 50) : 125.0f;
  });
  EXPECT_GE(start.first, 125);
  EXPECT_LE(start.first, 135);
  EXPECT_TRUE(start.second);
  // Nobody waits for ever.
  EXPECT_EQ(settles([](int) { return 3.0f; }).first, steps::exposure::kLongest - 1);
}

// ---- Streams ----

constexpr int kWidth = 160, kHeight = 120, kFrames = 420;

struct Camera {
  const char* name;
  // A sample of a channel in that frame; luma: of its pixel.
  std::function<float(int frame, size_t channel, float sample, float luma)> shows;
  int counts_from;
};

float swing(int t) { return std::sin(2 * std::numbers::pi_v<float> * static_cast<float>(t) / 100); }

const Camera kCameras[] = {
    {"clip",
     [](int t, size_t, float sample, float) {
       return sample * 1.15f *
              (1 + 0.2f * std::sin(2 * std::numbers::pi_v<float> * static_cast<float>(t) / 100));
     },
     100},
    {"glare",
     [](int t, size_t, float sample, float) {
       return sample * 1.7f *
              (1 + 0.25f * std::sin(2 * std::numbers::pi_v<float> * static_cast<float>(t) / 100));
     },
     100},
    {"slow",
     [](int t, size_t, float sample, float) { return sample * 1.3f * (1 + 0.08f * swing(t / 2)); },
     100},
    {"start",
     [](int t, size_t, float sample, float) {
       return sample * (t < 50    ? 0.06f
                        : t < 125 ? 2.2f - 1.2f * static_cast<float>(t - 50) / 75
                                  : 1.0f);
     },
     150},
    {"infrared",
     [](int t, size_t, float sample, float luma) { return t < 200 ? sample : 1.15f * luma; }, 100},
    {"night and day",
     [](int t, size_t, float sample, float luma) {
       return t < 150 || t >= 280 ? sample : 1.15f * luma;
     },
     100},
    {"grey", [](int, size_t, float, float luma) { return luma; }, 100},
    {"white balance",
     [](int t, size_t c, float sample, float) {
       const float shift = 0.15f * swing(t);
       return sample * (c == 0 ? 1 + shift : c == 2 ? 1 - shift : 1);
     },
     100},
};

// F of the masks of frames that count, and how many of these are wrong in more than 2 % of the
// picture. whites: of each frame, how many pixels are white; or null.
std::pair<double, int> score(const Camera& camera, const EngineOptions& options, uint64_t seed,
                             const char* name = "basic", int frames = kFrames,
                             std::vector<int>* whites = nullptr) {
  scene::SceneOptions how;
  how.width = kWidth, how.height = kHeight, how.frames_per_second = 25, how.seed = seed;
  scene::Scene scene(how, name);
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  Wishes wishes = first_wishes(options);
  std::vector<std::vector<bool>> truth;
  double both = 0, sum = 0;
  int left = 0, wrong = 0;
  const auto take = [&] {
    for (; engine.next(); ++left) {
      PackedPicture mask(kWidth, kHeight);
      engine.next()->pop(Output::mask, mask.out());
      if (whites) {
        whites->push_back(0);
        for (size_t p = 0; p < truth[0].size(); ++p) whites->back() += mask.at(0, p) > 127;
      }
      if (left < camera.counts_from) continue;
      int differ = 0;
      for (size_t p = 0; p < truth[0].size(); ++p) {
        const bool white = mask.at(0, p) > 127, right = truth[static_cast<size_t>(left)][p];
        both += white && right, sum += white + right, differ += white != right;
      }
      wrong += 50 * differ > kWidth * kHeight;
    }
  };
  for (int t = 0; t < frames; ++t) {
    scene.render(t, scene::kFrame | scene::kLabels);
    PackedPicture picture(kWidth, kHeight);
    std::vector<uint8_t> planes(3 * size_t{kWidth} * kHeight);
    const auto& samples = scene.frame().samples;
    std::vector<bool>& is_foreground = truth.emplace_back();
    for (size_t p = 0; p < size_t{kWidth} * kHeight; ++p) {
      const float luma =
          0.299f * samples[3 * p] + 0.587f * samples[3 * p + 1] + 0.114f * samples[3 * p + 2];
      std::array<float, 3> shown;
      for (size_t c = 0; c < 3; ++c)
        shown[c] = byte_of(camera.shows(t, c, samples[3 * p + c], luma));
      if (options.colours == Colours::yuv) shown = yuv_of(shown[0], shown[1], shown[2]);
      for (size_t c = 0; c < 3; ++c) planes[c * kWidth * kHeight + p] = byte_of(shown[c]);
      is_foreground.push_back(scene.labels().samples[p] > 127);
    }
    picture.fill(planes);
    EXPECT_TRUE(engine.push(picture.in(), &wishes).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  EXPECT_EQ(left, frames);
  return {2 * both / sum, wrong};
}

class CameraLight : public testing::TestWithParam<std::tuple<Mode, Colours>> {};
std::string name_of(const testing::TestParamInfo<std::tuple<Mode, Colours>>& of) {
  return std::string(std::get<Mode>(of.param) == Mode::live ? "Live" : "Batch") +
         (std::get<Colours>(of.param) == Colours::yuv ? "Yuv" : "Rgb");
}
INSTANTIATE_TEST_SUITE_P(Modes, CameraLight,
                         testing::Combine(testing::Values(Mode::batch, Mode::live),
                                          testing::Values(Colours::rgb, Colours::yuv)),
                         name_of);

TEST_P(CameraLight, MasksStayRight) {
  for (const Camera& camera : kCameras)
    for (const uint64_t seed : {3, 7}) {
      EngineOptions options = robust_of(100);
      std::tie(options.mode, options.colours) = GetParam();
      if (options.colours == Colours::yuv) options.levels = kVideo;
      const auto [f, wrong] = score(camera, options, seed);
      RecordProperty(camera.name, std::to_string(f));
      EXPECT_GE(f, 0.9) << camera.name << ", seed " << seed;
      EXPECT_LE(wrong, 10) << camera.name << ", seed " << seed;
    }
}

// Black frames are no background, and nothing is in front of them: with a camera that starts, and
// where one loses its picture.
TEST(BlackFrames, AreTheSceneInNoLight) {
  for (const int first : {0, 131})
    for (const int count : {29, 60, 95}) {
      // For longer it is another scene.
      if (first > 0 && count > 60) continue;
      SCOPED_TRACE(testing::Message() << count << " from " << first);
      const Camera camera = {"black",
                             [=](int t, size_t, float sample, float) {
                               return t >= first && t < first + count ? 0.0f : sample;
                             },
                             first + count};
      std::vector<int> white;
      const auto [f, wrong] = score(camera, robust_of(100), 3, "basic", 330, &white);
      EXPECT_GE(f, 0.85);
      EXPECT_LE(wrong, 2);
      for (int t = first; t < first + count; ++t) EXPECT_EQ(white[static_cast<size_t>(t)], 0) << t;
    }
}

// Who stands there clips at times, too: it is the same look, and does not take the place of what
// was known.
TEST(ClippedStanders, AreNoBackground) {
  for (const Mode mode : {Mode::batch, Mode::live}) {
    EngineOptions options = robust_of(100);
    options.mode = mode;
    const auto [f, wrong] = score(kCameras[1], options, 8, "stop", 700);
    EXPECT_GE(f, mode == Mode::batch ? 0.92 : 0.8);
    EXPECT_LE(wrong, 5);
  }
}

// In infra-red the places are those that were known in colour: who comes and stands soon after the
// switch is told from what was there.
TEST(InfraRed, StandersAreNoBackground) {
  const Camera camera = {
      "infrared",
      [](int t, size_t, float sample, float luma) { return t < 300 ? sample : 1.15f * luma; }, 400};
  const auto [f, wrong] = score(camera, robust_of(100), 9, "stop", 550);
  EXPECT_GE(f, 0.84);
  EXPECT_LE(wrong, 5);
}

// A window of 50 sees half of a swing: where it only sees the bright one, the darker pictures
// before say what is behind.
TEST(ShortWindows, APartOfASwingIsEnough) {
  const struct {
    Mode mode;
    int window;
    size_t camera;
  } kCases[] = {{Mode::batch, 25, 0},
                {Mode::batch, 25, 1},
                {Mode::batch, 50, 1},
                {Mode::live, 25, 0},
                {Mode::live, 50, 1}};
  for (const auto& of : kCases) {
    EngineOptions options = robust_of(of.window);
    options.mode = of.mode;
    const auto [f, wrong] = score(kCameras[of.camera], options, 3);
    EXPECT_GE(f, 0.9) << kCameras[of.camera].name << ", " << of.window;
    EXPECT_LE(wrong, 10) << kCameras[of.camera].name << ", " << of.window;
  }
}

}  // namespace
}  // namespace qdmd::test
