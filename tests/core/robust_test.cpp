// SPDX-License-Identifier: LGPL-2.1-or-later
// The engine with method=robust: windows without foreground, with much of it, and changing light.
#include <tuple>

#include "tests/core/robust_util.h"
#include "tests/stability/hard_cases.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 96, kHeight = 72;
constexpr size_t kPixels = size_t{kWidth} * kHeight;

// Waves, blocks and lines: something to see everywhere, nothing repeats.
double texture(double x, double y, size_t c) {
  const double wave = 25 * std::sin(0.13 * x + 0.05 * y + static_cast<double>(c)) +
                      20 * std::cos(0.021 * x * (1 + 0.01 * y));
  const double block = (static_cast<int>(x / 13) * 7 + static_cast<int>(y / 11) * 5) % 4 * 14.0;
  const double line = static_cast<int>(x + 2 * y) % 17 < 2 ? 25 : 0;
  return 70 + 8 * static_cast<double>(c) + wave + block + line;
}

std::vector<uint8_t> background(double gain = 1, double dx = 0, double dy = 0) {
  std::vector<uint8_t> picture(3 * kPixels);
  for (size_t c = 0; c < 3; ++c)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        picture[c * kPixels + static_cast<size_t>(y * kWidth + x)] = static_cast<uint8_t>(
            std::lround(std::clamp(gain * texture(x + 40 + dx, y + 40 + dy, c), 0.0, 255.0)));
  return picture;
}

void add_noise(Clip& clip, double sigma, uint32_t seed) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> noise(0, sigma);
  for (auto& frame : clip.frames)
    for (auto& sample : frame)
      sample = static_cast<uint8_t>(std::lround(std::clamp(sample + noise(rng), 0.0, 255.0)));
}

void box(std::vector<uint8_t>& frame, int left, int top, int width, int height, int colour,
         double gain = 1) {
  for (int y = std::max(0, top); y < std::min(kHeight, top + height); ++y)
    for (int x = std::max(0, left); x < std::min(kWidth, left + width); ++x)
      for (size_t c = 0; c < 3; ++c)
        frame[c * kPixels + static_cast<size_t>(y * kWidth + x)] = static_cast<uint8_t>(
            gain * ((colour * (static_cast<int>(c) + 2) + 5 * (x - left) % 20) % 200 + 20));
}

// Two boxes on their way.
void walkers(std::vector<uint8_t>& frame, int t, double gain = 1) {
  box(frame, t * 3 % (kWidth + 20) - 20, 10, 18, 30, 41, gain);
  box(frame, kWidth - t * 2 % (kWidth + 14), 40, 14, 24, 73, gain);
}

Clip walking_clip(size_t count, double sigma = 2) {
  Clip clip(kPixels, count);
  for (size_t t = 0; t < count; ++t) {
    clip.frames[t] = background();
    walkers(clip.frames[t], static_cast<int>(t));
  }
  add_noise(clip, sigma, 51);
  return clip;
}

std::vector<std::vector<uint8_t>> backgrounds_of(const Clip& clip,
                                                 int iterations = EngineOptions().iterations) {
  return run_engine(clip, kWidth, kHeight, robust_of(static_cast<int>(clip.size()), iterations));
}

double worst_error(const std::vector<std::vector<uint8_t>>& pictures,
                   const std::vector<uint8_t>& truth) {
  double worst = 0;
  for (const auto& picture : pictures) worst = std::max(worst, mean_error(picture, truth));
  return worst;
}

// ---- Nothing moves ----

TEST(RobustEngine, AStillPictureComesBack) {
  for (size_t count : {2, 3, 7, 60}) {
    const Clip clip = static_clip(background(), count);
    for (int iterations : {1, 2, 4}) {
      const auto found = backgrounds_of(clip, iterations);
      ASSERT_EQ(found.size(), count);
      for (const auto& picture : found)
        for (size_t i = 0; i < picture.size(); ++i)
          ASSERT_NEAR(picture[i], clip.frames[0][i], 1) << count << " frames, sample " << i;
    }
  }
}

TEST(RobustEngine, OneFrameIsItsOwnBackground) {
  const Clip clip = static_clip(background(), 1);
  const auto found = run_engine(clip, kWidth, kHeight, robust_of(20));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT(mean_error(found[0], clip.frames[0]), 0.5);
}

TEST(RobustEngine, BlackWhiteAndSinglePixels) {
  for (int level : {0, 1, 128, 254, 255})
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {5, 3}, {64, 2}, {50, 50}}) {
      const auto pixels = static_cast<size_t>(width * height);
      const Clip clip =
          static_clip(std::vector<uint8_t>(3 * pixels, static_cast<uint8_t>(level)), 9);
      for (const auto& picture : run_engine(clip, width, height, robust_of(9)))
        for (uint8_t sample : picture) ASSERT_NEAR(sample, level, 1) << width << " x " << height;
    }
}

// Two frames do not say which of them shows the background.
TEST(RobustEngine, TwoFramesComeBackWithinTheirNoise) {
  for (double sigma : {1.0, 3.0, 8.0, 20.0}) {
    Clip clip = static_clip(background(), 2);
    add_noise(clip, sigma, 52);
    EXPECT_LT(worst_error(backgrounds_of(clip), background()),
              1.05 * sigma * std::sqrt(2 / M_PI) + 0.3)
        << "sigma " << sigma;
  }
}

// The mean of m frames has noise sigma / sqrt(m) and is rounded; the median's is a quarter larger.
TEST(RobustEngine, NoiseIsAveragedOut) {
  for (double sigma : {1.0, 3.0, 8.0, 20.0})
    for (size_t count : {3, 4, 5, 9, 12, 20, 60}) {
      SCOPED_TRACE(testing::Message() << "sigma " << sigma << ", frames " << count);
      Clip clip = static_clip(background(), count);
      add_noise(clip, sigma, 52);
      const double mean_noise = sigma * std::sqrt(2 / M_PI) / std::sqrt(static_cast<double>(count));
      EXPECT_LT(worst_error(backgrounds_of(clip), background()), 1.3 * mean_noise + 0.3);
      // Foreground: none.
      size_t white = 0;
      const EngineOptions options = robust_of(static_cast<int>(count));
      for (const auto& mask : run_engine(clip, kWidth, kHeight, options, Output::mask))
        white += static_cast<size_t>(std::count(mask.begin(), mask.end(), 255));
      EXPECT_LT(static_cast<double>(white), 0.002 * static_cast<double>(3 * kPixels * count));
    }
}

TEST(RobustEngine, FramesThatRepeatChangeNothing) {
  const Clip once = walking_clip(30);
  Clip twice(kPixels, 60);
  for (size_t t = 0; t < 60; ++t) twice.frames[t] = once.frames[t / 2];
  const double error = worst_error(backgrounds_of(once), background());
  EXPECT_LT(worst_error(backgrounds_of(twice), background()), 1.15 * error + 0.1);
}

// ---- Foreground ----

TEST(RobustEngine, WalkersLeaveNoGhosts) {
  const Clip clip = walking_clip(80);
  for (int iterations : {1, 2, 3})
    EXPECT_LT(worst_error(backgrounds_of(clip, iterations), background()), 0.7);
  // What a least-squares method leaves.
  EngineOptions plain = robust_of(80);
  plain.method = Method::qdmd;
  plain.dmd.rank = 1;
  EXPECT_GT(worst_error(run_engine(clip, kWidth, kHeight, plain), background()), 4);
}

TEST(RobustEngine, AnotherRankIsNoWorse) {
  const Clip clip = walking_clip(80);
  for (int rank : {2, 3}) {
    EngineOptions options = robust_of(80);
    options.dmd.rank = rank;
    EXPECT_LT(worst_error(run_engine(clip, kWidth, kHeight, options), background()), 1) << rank;
  }
}

// For 60 % of the window, at its start, in its middle, at its end.
TEST(RobustEngine, WhoStandsStillIsForeground) {
  for (int start : {0, 20, 40}) {
    Clip clip(kPixels, 100);
    for (int t = 0; t < 100; ++t) {
      auto& frame = clip.frames[static_cast<size_t>(t)];
      frame = background();
      if (t >= start && t < start + 60) box(frame, 36, 20, 20, 36, 57);
    }
    add_noise(clip, 2, 53);
    EXPECT_GT(mean_error(temporal_median(clip), background()), 4);
    EXPECT_LT(worst_error(backgrounds_of(clip), background()), 0.7) << start;
  }
}

// Somebody in nearly the ground's colour differs by less than a shadow may.
TEST(RobustEngine, WhoStandsStillInTheGroundsColourIsForeground) {
  std::vector<uint8_t> ground(3 * kPixels);
  for (size_t i = 0; i < ground.size(); ++i)
    ground[i] = static_cast<uint8_t>(80 + i % kWidth / 4 + 10 * (i / kPixels));
  for (int start : {0, 20, 40}) {
    Clip clip(kPixels, 100);
    for (int t = 0; t < 100; ++t) {
      auto& frame = clip.frames[static_cast<size_t>(t)];
      frame = ground;
      if (t < start || t >= start + 60) continue;
      for (size_t c = 0; c < 3; ++c)
        for (size_t y = 20; y < 56; ++y)
          for (size_t x = 36; x < 56; ++x) frame[c * kPixels + y * kWidth + x] += 14;
    }
    add_noise(clip, 2, 55);
    EXPECT_GT(mean_error(temporal_median(clip), ground), 1);
    EXPECT_LT(worst_error(backgrounds_of(clip), ground), 0.5) << start;
  }
}

// ---- Light ----

double worst_error_in_light(const Clip& clip, const std::vector<double>& gains, int iterations) {
  const auto found = backgrounds_of(clip, iterations);
  double worst = 0;
  for (size_t t = 0; t < found.size(); ++t)
    worst = std::max(worst, mean_error(found[t], background(gains[t])));
  return worst;
}

Clip lit_clip(const std::vector<double>& gains) {
  Clip clip(kPixels, gains.size());
  for (size_t t = 0; t < gains.size(); ++t) {
    clip.frames[t] = background(gains[t]);
    walkers(clip.frames[t], static_cast<int>(t), gains[t]);
  }
  add_noise(clip, 2, 54);
  return clip;
}

double median_error_in_light(const Clip& clip, const std::vector<double>& gains) {
  const auto median = temporal_median(clip);
  double sum = 0;
  for (double gain : gains) sum += mean_error(median, background(gain));
  return sum / static_cast<double>(gains.size());
}

TEST(RobustEngine, AFadeIsFollowed) {
  for (double to : {0.6, 1.3}) {
    std::vector<double> gains;
    for (int t = 0; t < 100; ++t) gains.push_back(1 + (to - 1) * t / 99);
    const Clip clip = lit_clip(gains);
    for (int iterations : {1, 2, 3})
      EXPECT_LT(worst_error_in_light(clip, gains, iterations), 2) << to << ", " << iterations;
    if (to == 0.6) {
      EXPECT_GT(median_error_in_light(clip, gains), 9);
    }
  }
}

TEST(RobustEngine, BothSidesOfALightSwitchAreBackground) {
  for (double to : {0.5, 0.75, 1.4})
    for (int at : {20, 50, 75}) {
      std::vector<double> gains;
      for (int t = 0; t < 100; ++t) gains.push_back(t < at ? 1 : to);
      EXPECT_LT(worst_error_in_light(lit_clip(gains), gains, 2), 2) << to << " at " << at;
    }
}

// ---- Order, threads ----

TEST(RobustEngine, OrderAndRateMatterLittle) {
  const Clip clip = walking_clip(100);
  Clip reversed = clip, half(kPixels, 50);
  std::reverse(reversed.frames.begin(), reversed.frames.end());
  for (size_t t = 0; t < 50; ++t) half.frames[t] = clip.frames[2 * t];
  const double error = worst_error(backgrounds_of(clip), background());
  EXPECT_LT(worst_error(backgrounds_of(reversed), background()), 1.15 * error);
  // A mean of fewer frames is more often rounded to the next level.
  EXPECT_LT(worst_error(backgrounds_of(half), background()), 1.15 * error + 0.15);
}

// ---- From window to window ----

// In the second window of 40 somebody stands still all the time.
Clip standing_clip() {
  Clip clip(kPixels, 80);
  for (size_t t = 0; t < 80; ++t) {
    clip.frames[t] = background();
    walkers(clip.frames[t], static_cast<int>(t));
    if (t >= 40) box(clip.frames[t], 36, 20, 20, 40, 88);
  }
  add_noise(clip, 2, 52);
  return clip;
}

TEST(RobustWindows, WhoStandsThroughOneIsKnownFromTheOneBefore) {
  const auto pictures = run_engine(standing_clip(), kWidth, kHeight, robust_of(40, 1));
  ASSERT_EQ(pictures.size(), 80u);
  for (const auto& picture : pictures) EXPECT_LT(mean_error(picture, background()), 1.0);
  // The window alone takes the person for background.
  Clip second = standing_clip();
  second.frames.erase(second.frames.begin(), second.frames.begin() + 40);
  const auto alone = run_engine(second, kWidth, kHeight, robust_of(40, 1));
  EXPECT_GT(mean_error(alone[20], background()), 4);
}

// Light that changed between the windows changes nothing in that.
TEST(RobustWindows, KnowEachOtherInAnyLight) {
  Clip clip = standing_clip();
  for (size_t t = 40; t < 80; ++t)
    for (auto& sample : clip.frames[t]) sample = static_cast<uint8_t>(0.7 * sample + 0.5);
  const auto pictures = run_engine(clip, kWidth, kHeight, robust_of(40, 1));
  for (size_t t = 40; t < 80; ++t) EXPECT_LT(mean_error(pictures[t], background(0.7)), 1.2) << t;
}

// After a cut to another scene the first window is as good as without the one before.
TEST(RobustWindows, ACutIsNoGhost) {
  Clip clip = walking_clip(80);
  Clip other(kPixels, 40);
  for (size_t t = 0; t < 40; ++t) {
    other.frames[t] = background(1, 400, 300);
    walkers(other.frames[t], static_cast<int>(t));
  }
  add_noise(other, 2, 53);
  std::copy(other.frames.begin(), other.frames.end(), clip.frames.begin() + 40);
  const auto pictures = run_engine(clip, kWidth, kHeight, robust_of(40, 1));
  const auto alone = run_engine(other, kWidth, kHeight, robust_of(40, 1));
  for (size_t t = 0; t < 40; ++t) EXPECT_EQ(pictures[40 + t], alone[t]) << t;
}

// A flush forgets; a drain does not.
TEST(RobustWindows, AFlushForgets) {
  const Clip clip = standing_clip();
  for (bool flush : {false, true}) {
    Engine engine;
    ASSERT_TRUE(engine.configure(robust_of(40, 1), kWidth, kHeight).ok());
    std::vector<uint8_t> last;
    const auto take = [&] {
      while (engine.next()) {
        PackedPicture picture(kWidth, kHeight);
        engine.next()->pop(Output::background, picture.out());
        last = picture.planes();
      }
    };
    for (size_t t = 0; t < 80; ++t) {
      if (t == 40 && flush) engine.flush();
      if (t == 40 && !flush) {
        ASSERT_TRUE(engine.drain().ok());
        take();
      }
      PackedPicture picture(kWidth, kHeight);
      picture.fill(clip.frames[t]);
      ASSERT_TRUE(engine.push(picture.in()).ok());
      take();
    }
    if (flush)
      EXPECT_GT(mean_error(last, background()), 4);
    else
      EXPECT_LT(mean_error(last, background()), 1);
  }
}

TEST(RobustWindows, LiveKnowsThemToo) {
  EngineOptions options = robust_of(40, 1);
  options.mode = Mode::live;
  options.hop_size = 10;
  const auto pictures = run_engine(standing_clip(), kWidth, kHeight, options);
  ASSERT_EQ(pictures.size(), 80u);
  EXPECT_LT(mean_error(pictures[79], background()), 1.0);
}

TEST(RobustEngine, ThreadsChangeNothing) {
  std::vector<double> gains;
  for (int t = 0; t < 70; ++t) gains.push_back(t < 30 ? 1 : 0.7);
  const Clip clip = lit_clip(gains);
  for (Mode mode : {Mode::batch, Mode::live})
    for (Output output : {Output::background, Output::mask}) {
      EngineOptions options = robust_of(40);
      options.mode = mode;
      const auto one = run_engine(clip, kWidth, kHeight, options, output);
      for (int threads : {2, 3}) {
        options.threads = threads;
        EXPECT_EQ(run_engine(clip, kWidth, kHeight, options, output), one) << threads;
      }
    }
}

// ---- Live ----

TEST(RobustEngine, LiveEveryFrameComesOut) {
  const Clip clip = walking_clip(150);
  EngineOptions options = robust_of(60);
  options.mode = Mode::live;
  Engine engine;
  ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  for (size_t t = 0; t < clip.size(); ++t) {
    PackedPicture picture(kWidth, kHeight);
    picture.fill(clip.frames[t]);
    ASSERT_TRUE(engine.push(picture.in()).ok());
    ASSERT_TRUE(engine.next());
    engine.next()->pop(Output::background, picture.out());
    ASSERT_FALSE(engine.next());
    // A window that has been full for a solve.
    if (t >= 80) {
      EXPECT_LT(mean_error(picture.planes(), background()), 1) << t;
    }
  }
  EXPECT_GT(engine.report().solves, 5u);
}

// ---- Memory ----

TEST(RobustEngine, MemoryBesideTheFramesCounts) {
  EngineOptions options = robust_of(100);
  const EngineLayout layout = layout_of(options, 1920, 1080);
  EXPECT_EQ(layout.frame_bytes, uint64_t{100} * 3 * 1920 * 1080);
  // A mask has a bit a pixel, the pictures are those of some frames, and a quarter as many as the
  // window has are remembered, of which a solve sees every second frame.
  EXPECT_GT(layout.bytes, layout.frame_bytes * 5 / 4 + uint64_t{50} * 1920 * 1080 / 8);
  EXPECT_LT(layout.bytes, layout.frame_bytes * 3 / 2);
  options.max_memory = layout.bytes;
  EXPECT_TRUE(check_options(options, 1920, 1080).ok());
  options.max_memory = layout.bytes - 1;
  const Status status = check_options(options, 1920, 1080);
  EXPECT_EQ(status.code, Status::Code::too_much_memory);
  EXPECT_NE(status.message.find(std::to_string(layout.frame_bytes)), std::string::npos);
}

// ---- Hard cases ----

// How far pictures of L(t) leave the range of their clip's frames, in levels.
int excursion(const std::vector<std::vector<uint8_t>>& pictures, const Clip& clip) {
  int low[3] = {255, 255, 255}, high[3] = {0, 0, 0}, worst = 0;
  for (const auto& frame : clip.frames)
    for (size_t i = 0; i < frame.size(); ++i) {
      const size_t c = i / clip.pixels;
      low[c] = std::min<int>(low[c], frame[i]), high[c] = std::max<int>(high[c], frame[i]);
    }
  for (const auto& picture : pictures)
    for (size_t i = 0; i < picture.size(); ++i) {
      const size_t c = i / clip.pixels;
      worst = std::max({worst, low[c] - picture[i], picture[i] - high[c]});
    }
  return worst;
}

TEST(RobustEngine, HardCasesPass) {
  for (const auto& hard : stability::hard_cases()) {
    SCOPED_TRACE(hard.name);
    const Window window = hard.make();
    const int pixels = static_cast<int>(window.pixels());
    Clip clip(window.pixels(), static_cast<size_t>(window.size()));
    for (int t = 0; t < window.size(); ++t)
      for (int c = 0; c < kChannels; ++c)
        std::copy_n(window.plane(window.slot(t), c), pixels,
                    clip.frames[static_cast<size_t>(t)].begin() + c * pixels);
    // As a row, as a small picture, or as a large one.
    const std::vector<int> heights = hard.large ? std::vector{2160} : std::vector{1, 4};
    for (int height : heights) {
      if (pixels % height != 0) continue;
      // The default first, then one thing at a time.
      for (const auto& [mode, iterations, rank] : {std::tuple{Mode::batch, 1, 0},
                                                   {Mode::live, 1, 0},
                                                   {Mode::batch, 2, 0},
                                                   {Mode::batch, 1, 3},
                                                   {Mode::batch, 2, 3}}) {
        // Seconds each.
        if (hard.large && (mode == Mode::live || iterations > 1)) continue;
        EngineOptions options = robust_of(std::max(2, window.size()), iterations);
        options.mode = mode;
        options.dmd.rank = rank;
        Engine engine;
        ASSERT_TRUE(engine.configure(options, pixels / height, height).ok());
        std::vector<std::vector<uint8_t>> pictures;
        const auto take = [&] {
          while (engine.next()) {
            PackedPicture picture(pixels / height, height);
            engine.next()->pop(Output::background, picture.out());
            pictures.push_back(picture.planes());
          }
        };
        for (const auto& frame : clip.frames) {
          PackedPicture picture(pixels / height, height);
          picture.fill(frame);
          ASSERT_TRUE(engine.push(picture.in()).ok());
          take();
        }
        ASSERT_TRUE(engine.drain().ok());
        take();
        const SolveReport& report = engine.report().solve;
        EXPECT_TRUE(std::isfinite(report.dmd.lambda.real()));
        EXPECT_TRUE(std::isfinite(report.dmd.lambda.imag()));
        EXPECT_TRUE(std::isfinite(report.dmd.residual));
        EXPECT_TRUE(std::isfinite(report.foreground.noise));
        EXPECT_TRUE(std::isfinite(report.foreground.threshold));
        EXPECT_TRUE(report.dmd.converged);
        EXPECT_EQ(pictures.size(), clip.size());
        // With a few pixels noise alone makes the mode decay (plain Q-DMD's does, too).
        if (pixels < 16) continue;
        // A live model is taken beyond its window: one of two frames that differ in their light
        // goes on with the change.
        if (mode == Mode::live && (hard.name == "black first frame" || hard.name == "eigenvalue 0"))
          continue;
        // A background is nowhere outside of what its frames were in, but for a change of light. A
        // ramp goes on in live mode, by no more than what a frame adds.
        constexpr int kRampStep = 15;
        EXPECT_LE(excursion(pictures, clip),
                  mode == Mode::live && hard.name == "Jordan pair" ? kRampStep : 3)
            << "height " << height << ", rank " << rank << ", iterations " << iterations
            << (mode == Mode::live ? ", live" : "");
      }
    }
  }
}

}  // namespace
}  // namespace qdmd::test
