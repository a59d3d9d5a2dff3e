// SPDX-License-Identifier: LGPL-2.1-or-later
// method=robust on simulated scenes and on shaken pictures of real size, against the truth.
#include "core/scene/scene.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 160, kHeight = 120, kFrames = 100;

// A scene's frames and true backgrounds.
struct Footage {
  Clip frames{0, 0}, truth{0, 0};

  Footage(const char* text, int width, int height, int count, uint64_t seed = 17,
          double frames_per_second = 5) {
    scene::SceneOptions options;
    options.width = width;
    options.height = height;
    options.seed = seed;
    options.frames_per_second = frames_per_second;  // at 5, things take their time
    scene::Scene scene(options, text);
    const auto pixels = static_cast<size_t>(width * height);
    frames = truth = Clip(pixels, static_cast<size_t>(count));
    for (int t = 0; t < count; ++t) {
      scene.render(t, scene::kFrame | scene::kTruth);
      for (size_t c = 0; c < 3; ++c)
        for (size_t p = 0; p < pixels; ++p) {
          frames.at(static_cast<size_t>(t), c, p) = scene.frame().samples[3 * p + c];
          truth.at(static_cast<size_t>(t), c, p) = scene.background().samples[3 * p + c];
        }
    }
  }
};

struct Errors {
  double mean = 0, worst = 0, median = 0;  // per frame; of the temporal median: mean
};

Errors errors_of(const char* text, int iterations, int count = kFrames, int width = kWidth,
                 int height = kHeight, uint64_t seed = 17) {
  const Footage footage(text, width, height, count, seed);
  const auto found = run_engine(footage.frames, width, height, robust_of(count, iterations));
  const auto median = temporal_median(footage.frames);
  Errors errors;
  for (size_t t = 0; t < found.size(); ++t) {
    const double error = mean_error(found[t], footage.truth.frames[t]);
    errors.mean += error / count;
    errors.worst = std::max(errors.worst, error);
    errors.median += mean_error(median, footage.truth.frames[t]) / count;
  }
  return errors;
}

// What a user gets who sets nothing, and what more effort gives.
constexpr int kIterations[] = {1, 2};

// A mean of every second of the window's m frames with that noise, rounded to 8 bits:
// 0.8 sigma / sqrt(m / 2) is the mean absolute value of its noise, and rounding moves a level by a
// quarter on average.
double noise_left(double sigma) { return 0.8 * sigma / std::sqrt(kFrames / 2) + 0.25; }

// The acceptance line: the light falls by 40 % over the window, and somebody walks.
TEST(RobustScenes, AFadeIsFollowed) {
  for (int iterations : kIterations)
    for (const auto& [text, sigma] :
         {std::pair{"fade=0.4:duration=20", 0.0}, {"fade=0.4:duration=20,noise=2", 2.0}}) {
      const Errors errors = errors_of(text, iterations);
      EXPECT_LT(errors.worst, noise_left(sigma)) << text;
      EXPECT_GT(errors.median, 10) << text;
    }
}

TEST(RobustScenes, ALightSwitchIsNoBlend) {
  for (int iterations : kIterations) {
    const Errors errors = errors_of("light-switch,noise=2", iterations);
    EXPECT_LT(errors.worst, noise_left(2));
    EXPECT_GT(errors.median, 10);
  }
}

// What a camera on a wall sees. A level in one of a hundred samples is for what the median itself
// leaves to chance: pixels that are covered half of the time. The median is that of all frames;
// robust looks at every second one, which leaves more of much noise.
TEST(RobustScenes, AreNoWorseThanTheMedian) {
  for (int iterations : kIterations)
    for (const char* text : {"default", "noise=3", "low-rate=5", "abandon", "remove", "shadow",
                             "camouflage", "bootstrap", "exposure"}) {
      const Errors errors = errors_of(text, iterations);
      const double noise = std::string_view(text) == "noise=3" ? errors.median : 0;
      EXPECT_LT(errors.mean, errors.median + noise + 0.01) << text << " " << iterations;
    }
}

// Somebody is at a place for most of the window: the median is him.
TEST(RobustScenes, AreBetterThanTheMedianWhereSomebodyStays) {
  for (int iterations : kIterations)
    for (const char* text : {"stop=8", "abandon"}) {
      const Errors errors = errors_of(text, iterations);
      EXPECT_LT(errors.worst, 0.01) << text;
      EXPECT_GT(errors.median, 0.4) << text;
    }
}

// Leaves near the camera, which hide most of the picture: of a place the background is seen in 10
// to 40 % of the frames, and never all that is beside it. Levels are means over all channels and
// frames of the window.
TEST(RobustScenes, AreBehindLeavesThatHideMostOfTheTime) {
  for (int iterations : kIterations)
    for (const char* text : {"foliage,noise=2", "foliage=80,noise=2", "foliage=60:cover=75"}) {
      const Errors errors = errors_of(text, iterations, 3 * kFrames, 320, 240);
      EXPECT_LT(errors.worst, 3) << text;
      EXPECT_GT(errors.median, 10) << text;
    }
}

// In a corner leaves do not move for half of the clip. Some of what they hide is then seen in less
// than a tenth of the frames, of other seeds in less than a thirtieth, where nothing helps.
TEST(RobustScenes, AreBehindLeavesThatRestForHalfOfTheClip) {
  for (const auto& [text, seed] : {std::pair{"foliage:rest=30,noise=2", 21},
                                   {"foliage:rest=30,noise=2", 23},
                                   {"foliage:rest=6,noise=2", 17},
                                   {"foliage=60:cover=75:rest=30", 17},
                                   {"foliage=60:cover=70:rest=30,noise=2", 22}}) {
    const Errors errors = errors_of(text, 1, 3 * kFrames, 320, 240, static_cast<uint64_t>(seed));
    EXPECT_LT(errors.worst, 3) << text << " " << seed;
    EXPECT_GT(errors.median, 10) << text;
  }
}

// The background has two states, and no still picture is both. The one that is there a third of
// the time is half again as far from the truth as their mean.
TEST(RobustScenes, AFlickerIsOneOfItsStates) {
  for (int iterations : kIterations) {
    const Errors errors = errors_of("flicker", iterations);
    EXPECT_LT(errors.mean, 1.5 * errors.median);
  }
}

// ---- Camera shake ----

double gradient_energy(const std::vector<uint8_t>& picture, int width, int height) {
  const size_t pixels = picture.size() / 3;
  const auto row = static_cast<size_t>(width);
  double sum = 0;
  for (size_t c = 0; c < 3; ++c)
    for (int y = 3; y < height - 3; ++y)
      for (int x = 3; x < width - 3; ++x) {
        const size_t p = c * pixels + static_cast<size_t>(y) * row + static_cast<size_t>(x);
        sum += std::pow(picture[p + 1] - picture[p - 1], 2) +
               std::pow(picture[p + row] - picture[p - row], 2);
      }
  return sum;
}

// The street without anybody, seen through a camera that jumps by whole pixels, and a walker.
TEST(RobustScenes, AShakingCameraIsAsSharpAsTheMedian) {
  constexpr int kMargin = 4, kW = 320, kH = 240;
  const Footage street("default", kW + 2 * kMargin, kH + 2 * kMargin, 1);
  const auto shifted = [&](int dx, int dy) {
    std::vector<uint8_t> picture(size_t{3} * kW * kH);
    for (size_t c = 0; c < 3; ++c)
      for (int y = 0; y < kH; ++y)
        for (int x = 0; x < kW; ++x)
          picture[c * kW * kH + static_cast<size_t>(y * kW + x)] = street.truth.at(
              0, c,
              static_cast<size_t>((y + dy + kMargin) * (kW + 2 * kMargin) + x + dx + kMargin));
    return picture;
  };
  for (int reach : {1, 2}) {
    std::mt19937 rng(55);
    std::normal_distribution<double> noise(0, 1);
    Clip clip(size_t{kW} * kH, 80);
    for (size_t t = 0; t < 80; ++t) {
      const auto span = static_cast<uint32_t>(2 * reach + 1);
      const int dx = static_cast<int>(rng() % span) - reach;
      const int dy = static_cast<int>(rng() % span) - reach;
      clip.frames[t] = shifted(dx, dy);
      for (int y = 60; y < 180; ++y)
        for (int x = static_cast<int>(5 * t) - 50; x < static_cast<int>(5 * t); ++x)
          if (x >= 0 && x < kW)
            for (size_t c = 0; c < 3; ++c)
              clip.at(t, c, static_cast<size_t>(y * kW + x)) = static_cast<uint8_t>(200 - 40 * c);
      for (auto& sample : clip.frames[t])
        sample = static_cast<uint8_t>(std::lround(std::clamp(sample + noise(rng), 0.0, 255.0)));
    }
    const double median = gradient_energy(temporal_median(clip), kW, kH);
    for (int iterations : kIterations) {
      const auto found = run_engine(clip, kW, kH, robust_of(80, iterations));
      EXPECT_GE(gradient_energy(found[40], kW, kH), median) << reach << " pixels";
    }
  }
}

// Lorries hide the street for 60 % of the time. Within a window several of one colour may look like
// the background. Nothing is proved by that, and more frames show the street than any lorry.
TEST(RobustScene, AStreetIsFoundAmongLorriesThatHideItForMostOfTheTime) {
  constexpr int kCount = 450;
  constexpr uint64_t kSeeds[] = {300, 301, 302, 303};
  for (const Mode mode : {Mode::batch, Mode::live}) {
    double error = 0;
    for (const uint64_t seed : kSeeds) {
      const Footage footage("basic,clutter", kWidth, kHeight, kCount, seed, 25);
      EngineOptions options = robust_of(100);
      options.mode = mode;
      const auto found = run_engine(footage.frames, kWidth, kHeight, options);
      ASSERT_EQ(found.size(), size_t{kCount});
      for (size_t t = kCount - 50; t < kCount; ++t)
        error += mean_error(found[t], footage.truth.frames[t]) / 50 / std::size(kSeeds);
    }
    EXPECT_LT(error, 5) << (mode == Mode::live ? "live" : "batch");
  }
}

}  // namespace
}  // namespace qdmd::test
