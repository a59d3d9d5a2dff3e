// SPDX-License-Identifier: LGPL-2.1-or-later
// The engine from the outside: frames in, pictures out.
#include <array>
#include <functional>
#include <limits>

#include "core/dmd/decompose.h"
#include "core/dmd/qdmd.h"
#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

using Pictures = std::vector<std::vector<uint8_t>>;

// ---- Counts and order ----

TEST(Engine, EveryFrameComesOutOnceAndInOrder) {
  std::mt19937 rng(111);
  for (size_t count : {1u, 2u, 7u, 19u, 20u, 21u, 47u, 60u}) {
    SCOPED_TRACE(count);
    const Clip clip = random_clip(100, count, rng);
    // Rank 1 cannot follow random frames, so nearly all pixels are foreground at a threshold
    // below one level and show which frame they came from.
    auto options = window_of(20);
    options.dmd.rank = 1;
    options.foreground_threshold = 0.5;
    Strip strip(clip.pixels, options);
    const auto out = strip.run(clip, Output::cutout);
    ASSERT_EQ(out.size(), count);
    EXPECT_EQ(strip.engine.report().pending, 0);
    EXPECT_EQ(strip.engine.report().solves, (count + 19) / 20);
    EXPECT_EQ(strip.engine.report().solve.window_frames,
              std::min<int>(20, static_cast<int>(count)));
    for (size_t t = 0; t < count; ++t) {
      size_t shown = 0;
      for (size_t i = 0; i < out[t].size(); ++i)
        if (out[t][i] != 0) {
          ++shown;
          ASSERT_EQ(out[t][i], clip.frames[t][i]) << "frame " << t;
        }
      // A single frame is its own background.
      if (count == 1) {
        EXPECT_EQ(shown, 0u);
      } else {
        EXPECT_GT(shown, 3 * clip.pixels / 2) << "frame " << t;
      }
    }
  }
}

TEST(Engine, PendingAndReadyFollowTheWindow) {
  std::mt19937 rng(112);
  Strip strip(10, window_of(4));
  EXPECT_EQ(strip.engine.report().delay, 3);
  for (int round = 0; round < 3; ++round) {
    for (int t = 0; t < 11; ++t) {
      SCOPED_TRACE(t);
      EXPECT_FALSE(strip.engine.next());
      EXPECT_EQ(strip.engine.report().pending, std::min(t, 3));
      ASSERT_TRUE(strip.push(random_picture(10, rng)).ok());
      EXPECT_EQ(strip.engine.report().pending, std::min(t + 1, 4));
      // From the fourth on, one leaves for each that comes; its window was solved with the last
      // frame of it.
      ASSERT_EQ(strip.engine.next() != nullptr, t >= 3);
      if (t >= 3) strip.pop(Output::background);
      EXPECT_FALSE(strip.engine.next());
      EXPECT_EQ(strip.engine.report().solves, static_cast<uint64_t>(3 * round + (t + 1) / 4));
      // The last frame of a window leaves with the third of the next.
      EXPECT_EQ(strip.engine.report().frames_left, t < 3 ? 0 : 3 - (t - 3) % 4);
    }
    // The window of frames 8 to 10 is not full: it ends with the frames before it.
    ASSERT_TRUE(strip.engine.drain().ok());
    for (int t = 3; t > 0; --t) {
      EXPECT_TRUE(strip.engine.next());
      EXPECT_EQ(strip.engine.report().pending, t);
      strip.pop(Output::background);
      EXPECT_EQ(strip.engine.report().frames_left, t - 1);
    }
    EXPECT_FALSE(strip.engine.next());
    EXPECT_EQ(strip.engine.report().solves, static_cast<uint64_t>(3 * round + 3));
  }
}

TEST(Engine, RemainderIsSolvedOnTheLastWholeWindow) {
  std::mt19937 rng(113);
  const Clip clip = noisy_clip(60, 13, 6, rng);
  auto options = window_of(10);
  Strip strip(clip.pixels, options), tail(clip.pixels, options);
  const auto out = strip.run(clip, Output::background);
  EXPECT_EQ(strip.engine.report().solve.window_frames, 10);
  EXPECT_EQ(strip.engine.report().solves, 2u);
  // The engine is as one that saw the last ten frames only.
  Clip last(clip.pixels, 0);
  last.frames.assign(clip.frames.begin() + 3, clip.frames.end());
  const auto expected = tail.run(last, Output::background);
  for (size_t t = 10; t < 13; ++t) EXPECT_EQ(out[t], expected[t - 3]) << t;
}

// Whoever drained because somebody wanted the frames at once.
TEST(Engine, GoesOnAfterADrainIfAsked) {
  std::mt19937 rng(115);
  const Clip clip = noisy_clip(60, 13, 6, rng);
  for (bool goes_on : {false, true}) {
    Strip strip(clip.pixels, window_of(8));
    for (size_t t = 0; t < 13; ++t) {
      ASSERT_TRUE(strip.push(clip.frames[t]).ok());
      if (t == 9) {
        strip.engine.go_on();
        ASSERT_TRUE(strip.engine.drain().ok());
        EXPECT_EQ(strip.engine.report().pending, 8);
      }
      strip.pop_all(Output::background);
      if (t == 9 && goes_on) strip.engine.go_on();
    }
    ASSERT_TRUE(strip.engine.drain().ok());
    EXPECT_EQ(strip.pop_all(Output::background).size(), 3u);
    EXPECT_EQ(strip.engine.report().solve.window_frames, goes_on ? 8 : 3);
  }
}

TEST(Engine, DrainBreaksTime) {
  std::mt19937 rng(114);
  Strip strip(10, window_of(8));
  EXPECT_TRUE(strip.engine.drain().ok());
  EXPECT_FALSE(strip.engine.next()) << "nothing to drain";
  EXPECT_EQ(strip.engine.report().solves, 0u);
  const auto first = random_picture(10, rng), second = random_picture(10, rng);
  for (int t = 0; t < 5; ++t) strip.push(first);
  strip.engine.drain();
  EXPECT_EQ(strip.pop_all(Output::background).size(), 5u);
  EXPECT_EQ(strip.engine.report().solve.window_frames, 5);
  for (int t = 0; t < 3; ++t) strip.push(second);
  strip.engine.drain();
  EXPECT_EQ(strip.engine.report().solve.window_frames, 3) << "frames before the drain are gone";
  for (const auto& picture : strip.pop_all(Output::background)) EXPECT_EQ(picture, second);
  EXPECT_FALSE(strip.engine.next());
}

// A window ends with its frames, whether anybody asked for their pictures or not.
TEST(Engine, FramesThatNobodyLooksAtLeaveLikeOthers) {
  std::mt19937 rng(115);
  for (const Method method : {Method::qdmd, Method::robust})
    for (int count : {1, 3, 5, 8, 9}) {
      SCOPED_TRACE(count);
      auto options = window_of(4);
      options.method = method;
      Strip looked(10, options), skipped(10, options);
      for (int stream = 0; stream < 4; ++stream) {
        for (int t = 0; t < count; ++t) {
          const auto picture = random_picture(10, rng);
          for (Strip* strip : {&looked, &skipped}) {
            ASSERT_TRUE(strip->push(picture).ok());
            while (strip->engine.next()) strip->engine.next()->skip();
          }
        }
        looked.engine.drain();
        skipped.engine.drain();
        const auto expected = looked.pop_all(Output::background);
        // Every second stream gives its last picture, the others none.
        while (skipped.engine.report().pending > stream % 2) skipped.engine.next()->skip();
        const auto last = skipped.pop_all(Output::background);
        if (stream % 2 == 1) {
          EXPECT_EQ(last.at(0), expected.back());
        }
        EXPECT_EQ(skipped.engine.report().solves, looked.engine.report().solves);
      }
    }
}

TEST(Engine, FlushForgets) {
  std::mt19937 rng(115);
  Strip strip(30, window_of(6));
  for (int t = 0; t < 5; ++t) strip.push(random_picture(30, rng));
  strip.engine.flush();
  EXPECT_EQ(strip.engine.report().pending, 0);
  const auto still = random_picture(30, rng);
  for (int t = 0; t < 6; ++t) {
    EXPECT_FALSE(strip.engine.next());
    strip.push(still);
  }
  ASSERT_TRUE(strip.engine.next());
  EXPECT_EQ(strip.pop(Output::background), still);
  // With frames ready.
  strip.engine.drain();
  EXPECT_TRUE(strip.engine.next());
  strip.engine.flush();
  EXPECT_EQ(strip.engine.report().pending, 0);
  EXPECT_FALSE(strip.engine.next());
  EXPECT_TRUE(strip.push(still).ok());
  strip.engine.drain();
  EXPECT_EQ(strip.engine.report().solve.window_frames, 1);
}

TEST(Engine, ConfigureStartsAfresh) {
  std::mt19937 rng(116);
  Strip strip(30, window_of(3));
  for (int t = 0; t < 3; ++t) strip.push(random_picture(30, rng));
  ASSERT_TRUE(strip.engine.configure(window_of(2), 5, 1).ok());
  strip.width = 5;
  EXPECT_FALSE(strip.engine.next());
  EXPECT_EQ(strip.engine.report().solves, 0u);
  EXPECT_EQ(strip.engine.report().solve.window_frames, 0);
  const auto still = random_picture(5, rng);
  strip.push(still);
  EXPECT_FALSE(strip.engine.next());
  strip.push(still);
  EXPECT_EQ(strip.pop_all(Output::background), (Pictures{still}));
  strip.engine.drain();
  EXPECT_EQ(strip.pop_all(Output::background), (Pictures{still}));
}

// ---- Refusals ----

TEST(EngineStatus, BeforeConfigure) {
  Engine engine;
  PackedPicture picture(2, 2);
  EXPECT_EQ(engine.push(picture.in()).code, Status::Code::not_configured);
  EXPECT_EQ(engine.drain().code, Status::Code::not_configured);
  EXPECT_FALSE(engine.next());
  engine.flush();
  EXPECT_FALSE(engine.next());
  EXPECT_EQ(engine.report().pending, 0);
  EXPECT_FALSE(engine.write_background(picture.out()));
  EXPECT_EQ(picture.bytes, PackedPicture(2, 2).bytes) << "nothing is written";
}

TEST(EngineStatus, PushWhileFramesAreWaiting) {
  std::mt19937 rng(117);
  const Clip clip = random_clip(20, 3, rng);
  Strip strip(20, window_of(3)), undisturbed(20, window_of(3));
  for (const auto& frame : clip.frames) strip.push(frame);
  const Status status = strip.push(random_picture(20, rng));
  EXPECT_EQ(status.code, Status::Code::frames_are_waiting);
  EXPECT_FALSE(status.ok());
  EXPECT_FALSE(status.message.empty());
  EXPECT_EQ(strip.engine.report().pending, 3);
  const auto expected = undisturbed.run(clip, Output::background);
  EXPECT_EQ(strip.pop_all(Output::background), (Pictures{expected[0]}));
  strip.engine.drain();
  EXPECT_EQ(strip.push(clip.frames[0]).code, Status::Code::frames_are_waiting) << "drained";
  EXPECT_EQ(strip.engine.report().pending, 2);
  EXPECT_EQ(strip.pop_all(Output::background), (Pictures{expected[1], expected[2]}));
  EXPECT_TRUE(strip.push(clip.frames[0]).ok());
}

Status::Code configured(const std::function<void(EngineOptions&)>& change, int width = 4,
                        int height = 3) {
  EngineOptions options = window_of(100);
  change(options);
  Engine engine;
  const Status status = engine.configure(options, width, height);
  EXPECT_EQ(status.ok(), status.message.empty());
  return status.code;
}

TEST(EngineStatus, FramesOfAnotherSize) {
  Strip strip(8, window_of(3));
  PackedPicture wider(9, 1), higher(8, 2);
  EXPECT_EQ(strip.engine.push(wider.in()).code, Status::Code::invalid_options);
  EXPECT_EQ(strip.engine.push(higher.in()).code, Status::Code::invalid_options);
  EXPECT_EQ(strip.engine.report().pending, 0);
}

TEST(EngineStatus, RangesOfTheOptions) {
  using Options = EngineOptions;
  constexpr auto kOk = Status::Code::ok, kInvalid = Status::Code::invalid_options;
  const double nan = std::nan("");
  for (int size : {-1, 0, 1, 2049})
    EXPECT_EQ(configured([&](Options& o) { o.window_size = size; }), kInvalid) << size;
  for (int size : {2, 2048})
    EXPECT_EQ(configured([&](Options& o) { o.window_size = size; }), kOk) << size;
  for (double value : {-1e-9, -kInfinity, nan}) {
    EXPECT_EQ(configured([&](Options& o) { o.dmd.omega_threshold = value; }), kInvalid);
    EXPECT_EQ(configured([&](Options& o) { o.foreground_threshold = value; }), kInvalid);
  }
  for (double value : {0.0, 7.5, kInfinity}) {
    EXPECT_EQ(configured([&](Options& o) { o.dmd.omega_threshold = value; }), kOk);
    EXPECT_EQ(configured([&](Options& o) { o.foreground_threshold = value; }), kOk);
  }
  for (int threads : {-1, 257})
    EXPECT_EQ(configured([&](Options& o) { o.threads = threads; }), kInvalid) << threads;
  for (int threads : {0, 1, 2, 256})
    EXPECT_EQ(configured([&](Options& o) { o.threads = threads; }), kOk) << threads;
  EXPECT_EQ(configured([&](Options& o) { o.dmd.rank = -1; }), kInvalid);
  EXPECT_EQ(configured([&](Options& o) { o.dmd.rank = 100000; }), kOk);
  for (int size : {0, -1}) {
    EXPECT_EQ(configured([](Options&) {}, size, 3), kInvalid);
    EXPECT_EQ(configured([](Options&) {}, 3, size), kInvalid);
  }
  EXPECT_EQ(configured([](Options&) {}, 1, 1), kOk);
}

// Of small frames, their number counts, and it does not help to scale them down.
TEST(Memory, RefusalSaysWhatManySmallFramesTake) {
  for (Method method : {Method::robust, Method::qdmd, Method::dmd})
    for (Mode mode : {Mode::batch, Mode::live}) {
      EngineOptions options;
      options.method = method;
      options.mode = mode;
      options.window_size = 1000;
      options.max_memory = 1;
      options.frame_rate = 25;
      const std::string small = EnginePlan(options, 8, 8).status().message;
      EXPECT_NE(small.find(" to decompose so many frames of any size"), std::string::npos) << small;
      EXPECT_EQ(small.find("scale the video down"), std::string::npos) << small;
      const std::string large = EnginePlan(options, 1920, 1080).status().message;
      EXPECT_EQ(large.find(" of any size"), std::string::npos) << large;
      EXPECT_NE(large.find("scale the video down"), std::string::npos) << large;
    }
}

TEST(EngineStatus, MemoryRefusalSaysWhatToChange) {
  auto options = window_of(50);
  const uint64_t needed = layout_of(options, 640, 480).bytes;
  EXPECT_GT(needed, Window::bytes(50, 640 * 480));
  options.max_memory = needed;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, 640, 480).ok());
  options.max_memory = needed - 1;
  const Status status = engine.configure(options, 640, 480);
  EXPECT_EQ(status.code, Status::Code::too_much_memory);
  for (const std::string& word : {std::string("window-size"), std::string("max-memory"),
                                  std::to_string(needed), std::to_string(needed - 1)})
    EXPECT_NE(status.message.find(word), std::string::npos) << word << " in " << status.message;
}

TEST(EngineStatus, AdjointSolverHasAMemoryNeedOfItsOwn) {
  auto options = window_of(50);
  options.max_memory = 10 * Window::bytes(50, 640 * 480);
  options.dmd.solver = Solver::adjoint;
  Engine engine;
  const Status status = engine.configure(options, 640, 480);
  EXPECT_EQ(status.code, Status::Code::too_much_memory);
  const auto needed = std::to_string(static_cast<uint64_t>(adjoint_bytes(640 * 480, 50)));
  for (const std::string& word : {std::string("window-size"), std::string("solver"), needed})
    EXPECT_NE(status.message.find(word), std::string::npos) << word << " in " << status.message;
  options.method = Method::dmd;  // which does not look at the solver
  EXPECT_TRUE(engine.configure(options, 640, 480).ok());
}

TEST(EngineStatus, MemoryNeedDoesNotWrapAround) {
  constexpr int kLongest = std::numeric_limits<int>::max();
  // 3 * 16 * 2^60 bytes are 0 modulo 2^64.
  for (const auto& [m, width, height] : {std::array{16, 1 << 30, 1 << 30},
                                         {2048, 8192, 8192},
                                         {2, kLongest, kLongest},
                                         {2048, kLongest, kLongest},
                                         {2048, kLongest, 32},
                                         {2048, 1 << 24, 32},
                                         {2048, 32, 1 << 24},
                                         {2, 1 << 18, 1 << 18},
                                         {2048, 32, kLongest}})
    for (Mode mode : {Mode::batch, Mode::live})
      for (Method method : {Method::qdmd, Method::robust, Method::dmd})
        for (Stabilize stabilize : {Stabilize::off, Stabilize::similarity})
          for (uint64_t most : {uint64_t{4} << 30, UINT64_MAX}) {
            auto options = window_of(m);
            options.mode = mode;
            options.method = method;
            options.stabilize = stabilize;
            options.mask_softness = 3;
            options.max_memory = most;
            const Status status = check_options(options, width, height);
            const bool too_many = uint64_t(width) * uint64_t(height) >= uint64_t{1} << 36 ||
                                  std::max(width, height) > 1 << 24;
            EXPECT_EQ(status.ok(), most == UINT64_MAX && !too_many)
                << m << " " << width << "x" << height << ": " << status.message;
            if (status.ok()) continue;
            EXPECT_EQ(status.code, Status::Code::too_much_memory) << status.message;
            for (const char* word : {"window-size", "max-memory"})
              EXPECT_NE(status.message.find(word), std::string::npos) << status.message;
            // What would be allocated is known to the byte.
            if (!too_many) {
              EXPECT_GT(layout_of(options, width, height).bytes, 3ull * static_cast<uint64_t>(m) *
                                                                     static_cast<uint64_t>(width) *
                                                                     static_cast<uint64_t>(height));
            }
          }
}

// ---- Windows that are their own background ----

TEST(EngineBackground, UniformWindowsComeBackExactly) {
  std::mt19937 rng(118);
  const std::vector<std::vector<uint8_t>> pictures = {
      random_picture(50, rng), std::vector<uint8_t>(150, 0),  std::vector<uint8_t>(150, 255),
      random_picture(1, rng),  std::vector<uint8_t>{0, 0, 1}, random_picture(1500, rng)};
  for (auto method : {Method::qdmd, Method::dmd})
    for (auto solver : {Solver::gram, Solver::adjoint})
      for (auto amplitude : {Amplitude::window, Amplitude::first_frame})
        for (double threshold : {0.0, 0.2})
          for (const auto& picture : pictures) {
            auto options = window_of(6);
            options.method = method;
            options.dmd = {solver, amplitude, 0, threshold};
            Strip strip(picture.size() / 3, options);
            const auto out = strip.run(static_clip(picture, 8), Output::background);
            ASSERT_EQ(out.size(), 8u);
            for (const auto& level : out) ASSERT_EQ(level, picture);
            EXPECT_EQ(strip.engine.report().solve.foreground.ratio, 0);
          }
}

TEST(EngineBackground, IsTheDecompositionOfItsWindow) {
  std::mt19937 rng(127);
  for (int size : {2, 3, 4, 5, 7, 9}) {
    const auto frames = static_cast<size_t>(size);
    const Clip clip = noisy_clip(90, 3 * frames, 10, rng);
    Strip strip(clip.pixels, window_of(size));
    const auto out = strip.run(clip, Output::background);
    for (size_t first = 0; first < clip.size(); first += frames) {
      Clip part(clip.pixels, frames);
      std::copy_n(clip.frames.begin() + static_cast<ptrdiff_t>(first), frames, part.frames.begin());
      const Window window = to_window(part);
      BackgroundModel model;
      model.build(window, decompose(window, gram_of(window), {}).background);
      for (size_t t = 0; t < frames; ++t) {
        std::vector<uint8_t> expected(3 * clip.pixels);
        uint8_t* const planes[3] = {expected.data(), expected.data() + clip.pixels,
                                    expected.data() + 2 * clip.pixels};
        model.set_time(static_cast<double>(t));
        model.evaluate(0, clip.pixels, planes);
        EXPECT_EQ(out[first + t], expected) << "window-size " << size << ", frame " << first + t;
      }
    }
  }
}

TEST(EngineBackground, AMovingBoxIsForegroundOnAStillPicture) {
  std::mt19937 rng(119);
  const size_t pixels = 400, count = 40, box = 20;
  const auto still = random_picture(pixels, rng, 20, 100);
  Clip clip = static_clip(still, count);
  for (size_t t = 0; t < count; ++t)
    for (size_t i = 0; i < box; ++i)
      for (size_t c = 0; c < 3; ++c) clip.at(t, c, t * 9 + i) = 230;
  auto options = window_of(static_cast<int>(count));
  options.dmd.rank = 1;
  Strip strip(pixels, options);
  const auto masks = strip.run(clip, Output::mask);
  size_t wrong = 0;
  for (size_t t = 0; t < count; ++t)
    for (size_t p = 0; p < pixels; ++p) {
      const bool inside = p >= t * 9 && p < t * 9 + box;
      if ((masks[t][p] != 0) != inside) ++wrong;
    }
  // The box covers a pixel for 2 or 3 frames of 40, which leaves ghosts of at most
  // (230 - 20) sqrt(3) 3 / 40 = 27 levels nearly everywhere. They count as noise and lift the
  // threshold above themselves; the box is more than 130 sqrt(3) - 27 = 198 levels away.
  EXPECT_LT(strip.engine.report().solve.foreground.threshold, 198);
  EXPECT_EQ(wrong, 0u);
  // The box is 5 % of the picture.
  EXPECT_GE(strip.engine.report().solve.foreground.ratio, 0.04);
}

}  // namespace
}  // namespace qdmd::test
