// SPDX-License-Identifier: LGPL-2.1-or-later
// sample-step: the decomposition sees every k-th pixel in x and y, the pictures are whole.
#include <malloc.h>

#include "tests/core/live_util.h"

namespace qdmd::test {
namespace {

struct Size {
  int width, height;
  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

// Pushes a clip of width x height through an engine; three planes each.
std::vector<std::vector<uint8_t>> run(const Clip& clip, const Size& size,
                                      const EngineOptions& options, SolveReport* report) {
  Engine engine;
  const Status status = engine.configure(options, size.width, size.height);
  EXPECT_TRUE(status.ok()) << status.message;
  std::vector<std::vector<uint8_t>> all;
  const auto take = [&] {
    while (engine.next()) {
      PackedPicture picture(size.width, size.height, 3);
      engine.next()->pop(Output::background, picture.out());
      all.push_back(picture.planes());
    }
  };
  for (const auto& frame : clip.frames) {
    PackedPicture picture(size.width, size.height, 3);
    picture.fill(frame);
    EXPECT_TRUE(engine.push(picture.in()).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  *report = engine.report().solve;
  return all;
}

constexpr Size kSizes[] = {{1, 1}, {2, 1}, {1, 7}, {9, 5}, {16, 16}, {33, 17}};
constexpr int kSteps[] = {1, 2, 3, 5, 64};

TEST(SampleStep, BatchIsTheDecompositionOfTheSampledClip) {
  std::mt19937 rng(351);
  for (const Size& size : kSizes)
    for (int step : kSteps)
      for (auto solver : {Solver::gram, Solver::qr, Solver::adjoint}) {
        const Clip clip = noisy_clip(size.pixels(), 12, 8, rng);
        auto options = window_of(6);
        options.sample_step = step;
        options.dmd.rank = 2;
        options.dmd.solver = solver;
        SolveReport report;
        const auto out = run(clip, size, options, &report);
        ASSERT_EQ(out.size(), 12u);
        EXPECT_EQ(report.sample_step, step);
        for (size_t first : {0, 6}) {
          const Clip part = part_of(clip, first, 6);
          FreshModel model(part, sampled(part, size.width, size.height, step), options);
          for (size_t t = 0; t < 6; ++t)
            ASSERT_EQ(out[first + t], model.background(static_cast<double>(t)))
                << size.width << "x" << size.height << ", step " << step << ", frame " << first + t;
        }
      }
}

TEST(SampleStep, LiveIsTheDecompositionOfTheSampledClip) {
  std::mt19937 rng(352);
  for (const Size& size : kSizes)
    for (int step : kSteps) {
      const Clip clip = noisy_clip(size.pixels(), 30, 8, rng);
      auto options = live_of(7, 3);
      options.sample_step = step;
      options.dmd.rank = 2;
      SolveReport report;
      const auto out = run(clip, size, options, &report);
      ASSERT_EQ(out.size(), 30u);
      EXPECT_EQ(report.sample_step, step);
      size_t first = 0;
      std::unique_ptr<FreshModel> model;
      for (size_t t = 0; t < 30; ++t) {
        if (is_boundary(static_cast<int>(t) + 1, 3)) {
          const size_t count = std::min<size_t>(t + 1, 7);
          first = t + 1 - count;
          const Clip part = part_of(clip, first, count);
          model = std::make_unique<FreshModel>(part, sampled(part, size.width, size.height, step),
                                               options);
        }
        ASSERT_EQ(out[t], model->background(static_cast<double>(t - first)))
            << size.width << "x" << size.height << ", step " << step << ", frame " << t;
      }
    }
}

// What only unsampled pixels show, the decomposition cannot know.
TEST(SampleStep, OtherPixelsDoNotMatterForTheDecomposition) {
  std::mt19937 rng(353);
  const Size size{10, 6};
  const Clip clip = noisy_clip(size.pixels(), 8, 8, rng);
  Clip other = clip;
  for (size_t t = 0; t < 8; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < size.pixels(); ++p)
        if (p % 10 % 3 != 0 || p / 10 % 3 != 0) other.at(t, c, p) = static_cast<uint8_t>(rng());
  auto options = window_of(8);
  options.sample_step = 3;
  SolveReport one, two;
  const auto a = run(clip, size, options, &one), b = run(other, size, options, &two);
  EXPECT_EQ(one.dmd.lambda, two.dmd.lambda);
  EXPECT_EQ(one.dmd.rank, two.dmd.rank);
  for (size_t t = 0; t < 8; ++t)
    for (size_t p = 0; p < size.pixels(); ++p)
      if (p % 10 % 3 == 0 && p / 10 % 3 == 0) {
        ASSERT_EQ(a[t][p], b[t][p]);
      }
}

// The allocators of sanitizers fill memory by themselves.
void fill_new_memory([[maybe_unused]] int byte) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  ASSERT_EQ(mallopt(M_PERTURB, byte), 1);
#endif
}

// Windows that end early, and frames that are in no model.
TEST(SampleStep, DrainFlushAndFreezeKeepSamplesInStep) {
  std::mt19937 rng(354);
  // Samples fill no cache line, and new memory is full of old bytes, which must not count.
  fill_new_memory(0x5B);
  for (Mode mode : {Mode::batch, Mode::live}) {
    const Size size{15, 9};
    const Clip clip = noisy_clip(size.pixels(), 40, 20, rng);
    auto options = live_of(8, 3);
    options.mode = mode;
    options.sample_step = 2;
    options.dmd.rank = 2;
    // Frames before `last` come in some way; the window of 6 that begins there must be as if alone.
    for (int way = 0; way < 4; ++way)
      for (size_t last : {1, 2, 3, 5, 8, 13}) {
        Engine engine;
        ASSERT_TRUE(engine.configure(options, size.width, size.height).ok());
        Wishes wishes = first_wishes(options);
        PackedPicture picture(size.width, size.height, 3);
        std::vector<std::vector<uint8_t>> out;
        const auto push = [&](size_t t) {
          picture.fill(clip.frames[t]);
          ASSERT_TRUE(engine.push(picture.in(), &wishes).ok());
          for (out.clear(); engine.next();) {
            engine.next()->pop(Output::background, picture.out());
            out.push_back(picture.planes());
          }
        };
        for (size_t t = 0; t < last; ++t) {
          wishes.freeze = way == 2 || (way == 3 && t >= 2);
          push(t);
        }
        wishes.freeze = false;
        engine.drain();
        while (engine.next()) engine.next()->pop(Output::background, picture.out());
        if (way == 1) engine.flush();
        for (size_t t = last; t < last + 6; ++t) push(t);
        if (mode == Mode::batch) {
          engine.drain();
          while (engine.next()) {
            engine.next()->pop(Output::background, picture.out());
            out.push_back(picture.planes());
          }
        }
        // A new window's solves: hop, 1.5 hops, ... with a model; 1, 2, 3, 4, 6 without one.
        const size_t solved = is_boundary(6, 3, way == 1 ? 1 : 3) ? 6 : 5;
        const Clip part = part_of(clip, last, mode == Mode::batch ? 6 : solved);
        FreshModel model(part, sampled(part, size.width, size.height, 2), options);
        ASSERT_FALSE(out.empty());
        EXPECT_EQ(out.back(), model.background(5))
            << "mode " << static_cast<int>(mode) << ", way " << way << ", after " << last;
      }
  }
  fill_new_memory(0);
}

// As a person at a camera does it: no break in time between freeze and its end.
TEST(SampleStep, SamplesAfterAFreeze) {
  std::mt19937 rng(355);
  fill_new_memory(0x5B);
  const Size size{15, 9};
  const Clip clip = noisy_clip(size.pixels(), 40, 20, rng);
  auto options = live_of(12, 4);
  options.sample_step = 2;
  options.dmd.rank = 2;
  for (size_t begin : {1, 2, 5, 20})
    for (size_t length : {1, 2, 7}) {
      Engine engine;
      ASSERT_TRUE(engine.configure(options, size.width, size.height).ok());
      Wishes wishes = first_wishes(options);
      PackedPicture picture(size.width, size.height, 3);
      for (size_t t = 0; t < begin + length + 4; ++t) {
        wishes.freeze = t >= begin && t < begin + length;
        picture.fill(clip.frames[t]);
        ASSERT_TRUE(engine.push(picture.in(), &wishes).ok());
        engine.next()->pop(Output::background, picture.out());
      }
      const Clip part = part_of(clip, begin + length, 4);
      FreshModel model(part, sampled(part, size.width, size.height, 2), options);
      EXPECT_EQ(engine.report().solve.window_frames, 4);
      EXPECT_EQ(engine.report().solve.dmd.lambda, model.summary.lambda)
          << "frozen for " << length << " frames from " << begin;
      EXPECT_EQ(picture.planes(), model.background(3));
    }
  fill_new_memory(0);
}

// ---- What it costs ----

TEST(SampleStep, BytesOfTheFrames) {
  auto options = window_of(10);
  // Planes are padded to 64 bytes; each frame has two bytes that say what its alpha is.
  const auto frames = [](int count, uint64_t samples) {
    return uint64_t(count) * (3 * samples + 2 + sizeof(Pose));
  };
  EXPECT_EQ(layout_of(options, 640, 480).store_bytes, frames(10, 640 * 480));
  EXPECT_EQ(layout_of(options, 640, 480).capacity, 10);
  EXPECT_EQ(layout_of(options, 1, 1).store_bytes, frames(10, 64));
  options.sample_step = 1;
  EXPECT_EQ(layout_of(options, 640, 480).store_bytes, frames(10, 640 * 480));
  options.sample_step = 2;
  EXPECT_EQ(layout_of(options, 640, 480).store_bytes, frames(10, 640 * 480 + 320 * 240));
  EXPECT_EQ(layout_of(options, 641, 481).store_bytes,
            frames(10, (641 * 481 + 63) / 64 * 64 + (321 * 241 + 63) / 64 * 64));
  options.sample_step = 64;
  EXPECT_EQ(layout_of(options, 5, 5).store_bytes, frames(10, 64 + 64));
  EXPECT_EQ(layout_of(options, 5, 5).sample_step, 64);
  // Small live windows need nothing beside; of large frames, those that arrive during a solve.
  options = live_of(10);
  EXPECT_EQ(layout_of(options, 640, 480).capacity, 10);
  options = live_of(100, 25);
  const EngineLayout layout = layout_of(options, 1920, 1080);
  EXPECT_EQ(layout.capacity, 100 + LivePlan(100, 25, uint64_t{3} * 1920 * 1080).most_late_frames());
  EXPECT_GT(layout.capacity, 100);
  EXPECT_EQ(layout.store_bytes, frames(layout.capacity, 1920 * 1080));
}

TEST(SampleStep, ChosenStepIsOneWhereDigitsMatter) {
  auto options = window_of(10);
  EXPECT_EQ(layout_of(options, 640, 480).sample_step, 1) << "full rank";
  for (int rank : {9, 10, 2000}) {
    options.dmd.rank = rank;
    EXPECT_EQ(layout_of(options, 640, 480).sample_step, 1) << "rank " << rank << " is full";
  }
  options.dmd.rank = 1;
  for (auto solver : {Solver::gram_extended, Solver::qr, Solver::adjoint}) {
    options.dmd.solver = solver;
    EXPECT_EQ(layout_of(options, 640, 480).sample_step, 1);
  }
}

TEST(SampleStep, MemoryRefusalCountsTheSamples) {
  for (Mode mode : {Mode::batch, Mode::live}) {
    auto options = live_of(60);
    options.mode = mode;
    options.sample_step = 3;
    const uint64_t needed = layout_of(options, 1920, 1080).bytes;
    EXPECT_GT(needed, uint64_t{60} * 3 * (1920 * 1080 + 640 * 360) - 1);
    options.max_memory = needed;
    EXPECT_TRUE(check_options(options, 1920, 1080).ok());
    options.max_memory = needed - 1;
    const Status status = check_options(options, 1920, 1080);
    EXPECT_EQ(status.code, Status::Code::too_much_memory);
    for (const std::string& word :
         {std::string("window-size"), std::string("max-memory"), std::to_string(needed),
          std::to_string(needed - 1), std::string("1920x1080")})
      EXPECT_NE(status.message.find(word), std::string::npos) << word << " in " << status.message;
  }
}

TEST(SampleStep, RangeOfTheOption) {
  for (int step : {-1, 65, 1 << 20}) {
    auto options = window_of(5);
    options.sample_step = step;
    const Status status = check_options(options, 8, 8);
    EXPECT_EQ(status.code, Status::Code::invalid_options) << step;
    EXPECT_NE(status.message.find("sample-step"), std::string::npos) << status.message;
  }
  for (int step : {0, 1, 2, 64}) {
    auto options = window_of(5);
    options.sample_step = step;
    EXPECT_TRUE(check_options(options, 8, 8).ok()) << step;
  }
}

}  // namespace
}  // namespace qdmd::test
