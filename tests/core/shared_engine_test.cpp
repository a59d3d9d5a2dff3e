// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames whose pixels share samples of chroma, from the engine's one end to the other: what leaves
// is what leaves where each pixel's own samples are kept.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "core/engine/engine.h"
#include "tests/core/layouts.h"

namespace qdmd::test {
namespace {

// A still picture with noise, over which a bright square goes; light that changes, a camera that is
// pushed aside, and a square that stands and leaves, if they are wanted.
struct Scene {
  int width, height;
  bool light = false;
  int pushed_from = 1 << 20;  // frame
  int stands_until = 0;       // frame

  void paint(int t, VideoPicture* frame) const {
    std::mt19937 noise(static_cast<unsigned>(t));
    const int push = t >= pushed_from ? 3 : 0;
    for (int c = 0; c < kChannels; ++c) {
      const ChannelAt& at = frame->layout_of(c);
      for (int y = 0; y < height; y += at.rows)
        for (int x = 0; x < width; x += at.columns) {
          const int u = x + push, v = y + push;
          int level = 60 + (u * 37 / 4 % 64 + v * 23 / 3 % 50) + (u / 9 + v / 7) % 2 * 25 + 9 * c;
          if (u >= 2 * t && u < 2 * t + width / 4 && v > height / 3 && v < 2 * height / 3)
            level = 230 - 70 * c;
          if (t < stands_until && x > width / 2 && x < 3 * width / 4 && y < height / 3)
            level = 40 + 90 * c;
          if (light && t % 8 > 3) level = level * 9 / 10;
          level += static_cast<int>(noise() % 5);
          put(c, x, y, level, static_cast<int>(noise() & 255), frame);
        }
    }
    for (int y = 0; frame->has(3) && y < height; ++y)
      for (int x = 0; x < width; ++x) put(3, x, y, (x * y + t) & 255, x & 255, frame);
  }
  // below: of samples of more than 8 bits the bits below.
  static void put(int c, int x, int y, int level, int below, VideoPicture* frame) {
    const SampleBits bits = frame->bits();
    if (bits.is_deep())
      frame->put_word(c, x, y, level << bits.low() | (below & ((1 << bits.low()) - 1)));
    else
      frame->sample(c, x, y) = static_cast<uint8_t>(level);
  }
};

constexpr Output kOutputs[] = {Output::background, Output::foreground, Output::mask,
                               Output::cutout};

// All that leaves, of the four outputs in turn. moved: frames that the camera was found elsewhere.
std::vector<std::vector<uint8_t>> run(const EngineOptions& options, const VideoLayout& layout,
                                      const Scene& scene, int frames, int* moved) {
  Engine engine;
  EXPECT_TRUE(engine.configure(options, scene.width, scene.height).ok());
  const SampleBits bits = {options.depth, options.depth == 10 ? 6 : 0};
  VideoPicture in(layout, scene.width, scene.height, 3, bits);
  std::vector<std::vector<uint8_t>> all;
  const auto pop_all = [&] {
    for (; engine.next(); engine.next()->skip())
      for (int more = 0; more < 2; ++more) {
        VideoPicture out(layout, scene.width, scene.height, 1, bits);
        engine.next()->write(kOutputs[(all.size() + static_cast<size_t>(more)) % 4], options.levels,
                             out.view<uint8_t>());
        all.push_back(out.bytes());
      }
  };
  for (int t = 0; t < frames; ++t) {
    scene.paint(t, &in);
    EXPECT_TRUE(engine.push(in.view<const uint8_t>()).ok());
    *moved += !engine.report().newest_pose.is_rest();
    pop_all();
  }
  EXPECT_TRUE(engine.drain().ok());
  pop_all();
  EXPECT_EQ(engine.report().pending, 0);
  EXPECT_EQ(all.size(), static_cast<size_t>(2 * frames));
  return all;
}

EngineOptions options_of(Method method, Mode mode) {
  EngineOptions options;
  options.method = method;
  options.mode = mode;
  options.colours = Colours::yuv;
  options.window_size = 12;
  options.threads = 2;
  return options;
}

// Returns how many frames were moved.
int expect_the_same(EngineOptions options, const VideoLayout& layout, const Scene& scene,
                    int frames = 30) {
  SCOPED_TRACE(std::string(layout.name) + " " + std::to_string(scene.width) + "x" +
               std::to_string(scene.height) + ", method " +
               std::to_string(static_cast<int>(options.method)) + ", mode " +
               std::to_string(static_cast<int>(options.mode)) + ", " +
               std::to_string(options.depth) + " bits");
  int moved = 0, moved_too = 0;
  const auto plain = run(options, layout, scene, frames, &moved);
  options.chroma_columns = layout.at[1].columns;
  options.chroma_rows = layout.at[1].rows;
  const auto shared = run(options, layout, scene, frames, &moved_too);
  EXPECT_EQ(moved, moved_too);
  for (size_t i = 0; i < plain.size(); ++i) {
    EXPECT_EQ(plain[i], shared[i]) << "picture " << i;
    if (plain[i] != shared[i]) break;
  }
  return moved;
}

TEST(SharedEngine, EveryLayout) {
  for (const VideoLayout& layout : kVideoLayouts) {
    if (layout.at[1].columns != 2) continue;
    for (const auto& [width, height] : {std::pair{67, 43}, {64, 48}})
      expect_the_same(options_of(Method::robust, Mode::batch), layout, {width, height});
  }
}

TEST(SharedEngine, EveryMethodAndMode) {
  for (Method method : {Method::robust, Method::qdmd, Method::dmd})
    for (Mode mode : {Mode::batch, Mode::live})
      for (const auto& [width, height] : {std::pair{1, 1}, {3, 5}, {161, 79}}) {
        EngineOptions options = options_of(method, mode);
        expect_the_same(options, kVideoLayouts[0], {width, height});
        options.sample_step = 2;
        options.dmd.rank = 3;
        expect_the_same(options, kVideoLayouts[2], {width, height});
      }
}

TEST(SharedEngine, SolversThatReadPixels) {
  for (Solver solver : {Solver::qr, Solver::adjoint, Solver::gram_extended})
    for (Method method : {Method::qdmd, Method::robust}) {
      EngineOptions options = options_of(method, Mode::batch);
      options.dmd.solver = solver;
      expect_the_same(options, kVideoLayouts[0], {33, 21});
    }
}

TEST(SharedEngine, LightChanges) {
  for (Mode mode : {Mode::batch, Mode::live})
    expect_the_same(options_of(Method::robust, mode), kVideoLayouts[0], {161, 79, true});
}

TEST(SharedEngine, SoftMasksIterationsAndWhatIsAbsorbed) {
  EngineOptions options = options_of(Method::robust, Mode::live);
  options.mask_softness = 3;
  options.iterations = 2;
  expect_the_same(options, kVideoLayouts[0], {161, 79}, 50);
}

// What moves shares nothing from then on, in the frames that are kept, too.
TEST(SharedEngine, CameraIsPushed) {
  for (Method method : {Method::robust, Method::qdmd})
    for (Mode mode : {Mode::batch, Mode::live}) {
      EngineOptions options = options_of(method, mode);
      options.stabilize = Stabilize::translation;
      EXPECT_GT(expect_the_same(options, kVideoLayouts[0], {320, 160, false, 17}, 60), 0);
    }
}

// Samples of more than 8 bits share both digits: in what is solved, decided, mended and
// written. Below 2 levels of threshold all pixels are compared in full.
TEST(SharedEngine, MoreThanEightBits) {
  for (int depth : {10, 12, 16})
    for (Mode mode : {Mode::batch, Mode::live})
      for (const VideoLayout& layout : kVideoLayouts) {
        if (layout.at[1].columns != 2) continue;
        EngineOptions options = options_of(Method::robust, mode);
        options.depth = depth;
        options.foreground_threshold = depth == 12 ? 1.5 : 0;
        const VideoLayout words = of_words(layout);
        expect_the_same(options, words, {67, 43});
        expect_the_same(options, words, {1, 1}, 15);
        expect_the_same(options, words, {3, 5}, 15);
      }
}

TEST(SharedEngine, MoreThanEightBitsInEverythingElse) {
  const VideoLayout p010 = of_words(kVideoLayouts[2]);
  EngineOptions options = options_of(Method::robust, Mode::live);
  options.depth = 10;
  options.mask_softness = 3;
  options.iterations = 2;
  expect_the_same(options, p010, {161, 79, true}, 50);
  for (Mode mode : {Mode::batch, Mode::live}) {
    options = options_of(Method::robust, mode);
    options.depth = 10;
    options.stabilize = Stabilize::translation;
    EXPECT_GT(expect_the_same(options, p010, {320, 160, false, 17}, 60), 0);
  }
  // What is uncovered is mended.
  options = options_of(Method::robust, Mode::live);
  for (int depth : {8, 10}) {
    options.depth = depth;
    Scene scene = {161, 79};
    scene.stands_until = 60;
    expect_the_same(options, depth == 8 ? kVideoLayouts[2] : p010, scene, 90);
  }
  for (Method method : {Method::qdmd, Method::dmd}) {
    options = options_of(method, Mode::batch);
    options.depth = 10;
    options.sample_step = 2;
    expect_the_same(options, p010, {67, 43});
  }
}

// Passes ask for pixels in parts, of which these windows have several.
TEST(SharedEngine, OnDiskIsTheSame) {
  constexpr int kWindow = 40;
  const Scene scene = {640, 480};
  for (const auto& [layout, method] : {std::pair{kVideoLayouts[0], Method::robust},
                                       {kVideoLayouts[0], Method::qdmd},
                                       {kVideoLayouts[9], Method::qdmd}}) {
    EngineOptions options = options_of(method, Mode::batch);
    options.window_size = kWindow;
    options.chroma_columns = layout.at[1].columns;
    options.chroma_rows = layout.at[1].rows;
    int moved = 0;
    const auto in_memory = run(options, layout, scene, kWindow + 1, &moved);
    options.window_on_disk = std::filesystem::temp_directory_path().string();
    EXPECT_TRUE(run(options, layout, scene, kWindow + 1, &moved) == in_memory)
        << layout.name << ", method " << static_cast<int>(method);
  }
}

TEST(SharedEngine, TakesLessMemory) {
  for (const auto& [method, depth] :
       {std::pair{Method::robust, 8}, {Method::qdmd, 8}, {Method::dmd, 8}, {Method::robust, 10}}) {
    EngineOptions options = options_of(method, Mode::batch);
    options.window_size = 100;
    options.depth = depth;
    options.dmd.rank = 1;
    const auto plain = static_cast<double>(EnginePlan(options, 1920, 1080).layout().bytes);
    options.chroma_columns = options.chroma_rows = 2;
    const auto shared = static_cast<double>(EnginePlan(options, 1920, 1080).layout().bytes);
    EXPECT_LT(shared, 0.62 * plain) << static_cast<int>(method) << ", " << depth << " bits";
  }
}

// A camera is followed by green, which each pixel of RGB must have.
TEST(SharedEngine, OtherColoursThanYuvAreRefused) {
  EngineOptions options = options_of(Method::robust, Mode::batch);
  for (const auto& [columns, rows] : {std::pair{2, 2}, {2, 1}, {1, 2}}) {
    options.chroma_columns = columns;
    options.chroma_rows = rows;
    for (Colours colours : {Colours::rgb, Colours::grey}) {
      options.colours = colours;
      EXPECT_EQ(Status::Code::invalid_options, EnginePlan(options, 16, 16).status().code);
    }
    options.colours = Colours::yuv;
    EXPECT_TRUE(EnginePlan(options, 16, 16).status().ok());
  }
}

TEST(SharedEngine, FramesThatShareOtherSamplesAreRefused) {
  EngineOptions options = options_of(Method::robust, Mode::batch);
  options.chroma_columns = options.chroma_rows = 2;
  Engine engine;
  ASSERT_TRUE(engine.configure(options, 16, 16).ok());
  for (const VideoLayout& layout : kVideoLayouts) {
    const bool same = layout.at[1].columns == 2 && layout.at[1].rows == 2;
    VideoPicture frame(layout, 16, 16, 0);
    const Status status = engine.push(frame.view<const uint8_t>());
    EXPECT_EQ(status.ok(), same) << layout.name;
    if (!same) {
      EXPECT_EQ(status.code, Status::Code::invalid_options);
    }
  }
}

}  // namespace
}  // namespace qdmd::test
