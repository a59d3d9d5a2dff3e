// SPDX-License-Identifier: LGPL-2.1-or-later
// Live mode from the outside: each frame at once, against the newest model, as computed afresh.
#include "tests/core/live_util.h"

namespace qdmd::test {
namespace {

// A box crosses a noisy picture whose light drifts: every model differs, and time matters.
Clip busy_clip(size_t pixels, size_t count, std::mt19937& rng) {
  Clip clip = drifting_clip(pixels, count, 0.002, rng);
  std::normal_distribution<double> noise(0, 3);
  for (size_t t = 0; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels; ++p) clip.set(t, c, p, clip.at(t, c, p) + noise(rng));
  for (size_t t = 0; t < count; ++t)
    for (size_t i = 0; i < pixels / 8; ++i) clip.at(t, t % 3, (3 * t + i) % pixels) = 250;
  return clip;
}

// ---- As computed afresh ----

TEST(EngineLive, EqualsTheNaiveEvaluation) {
  std::mt19937 rng(301);
  const Clip clip = busy_clip(70, 80, rng);
  for (int window : {2, 5, 20})
    for (int hop : {0, 1, 2, window}) {
      SCOPED_TRACE("window " + std::to_string(window) + ", hop " + std::to_string(hop));
      expect_naive(clip, live_of(window, hop));
    }
}

TEST(EngineLive, EveryOutputEqualsItsDefinition) {
  std::mt19937 rng(302);
  const Clip clip = busy_clip(150, 40, rng);
  for (Output output : kOutputs)
    for (double threshold : {0.0, 12.0}) {
      auto options = live_of(12, 3);
      options.dmd.rank = 1;
      options.foreground_threshold = threshold;
      expect_naive(clip, options, output);
    }
}

TEST(EngineLive, EverySolverMethodAndAmplitude) {
  std::mt19937 rng(303);
  const Clip clip = busy_clip(40, 25, rng);
  for (auto method : {Method::qdmd, Method::dmd})
    for (auto solver : {Solver::gram, Solver::gram_extended, Solver::qr, Solver::adjoint})
      for (auto amplitude : {Amplitude::window, Amplitude::first_frame})
        for (int rank : {0, 1, 3}) {
          auto options = live_of(9, 4);
          options.method = method;
          options.dmd = {solver, amplitude, rank, 0};
          expect_naive(clip, options);
          ASSERT_FALSE(HasFailure()) << "method " << static_cast<int>(method) << ", solver "
                                     << static_cast<int>(solver) << ", rank " << rank;
        }
}

TEST(EngineLive, ManyModesAreCappedByTheWindow) {
  std::mt19937 rng(304);
  const Clip clip = busy_clip(40, 60, rng);
  for (auto method : {Method::qdmd, Method::dmd})
    for (double threshold : {0.5, 1e9, kInfinity}) {
      auto options = live_of(24, 6);
      options.method = method;
      options.dmd.omega_threshold = threshold;
      expect_naive(clip, options);
      Strip strip(clip.pixels, options);
      strip.run(clip, Output::background);
      EXPECT_LE(strip.engine.report().solve.dmd.background_modes, 24 / 8);
      EXPECT_GE(strip.engine.report().solve.dmd.background_modes, 1);
    }
}

TEST(EngineLive, DegenerateStreams) {
  std::mt19937 rng(305);
  const auto picture = random_picture(30, rng);
  Clip pairs = random_clip(30, 30, rng), blinking = static_clip(picture, 30);
  for (size_t t = 1; t < 30; t += 2) {
    pairs.frames[t] = pairs.frames[t - 1];
    blinking.frames[t].assign(90, 0);
  }
  for (const Clip& clip : {static_clip(std::vector<uint8_t>(90, 0), 30),
                           static_clip(std::vector<uint8_t>(90, 255), 30), static_clip(picture, 30),
                           static_clip(random_picture(1, rng), 30), static_clip({0, 0, 1}, 30),
                           random_clip(1, 30, rng), random_clip(2, 30, rng), pairs, blinking})
    for (auto method : {Method::qdmd, Method::dmd})
      for (int hop : {0, 1, 7}) {
        auto options = live_of(7, hop);
        options.method = method;
        expect_naive(clip, options);
      }
}

TEST(EngineLive, AStillPictureIsItsOwnBackground) {
  std::mt19937 rng(306);
  for (const auto& picture : {random_picture(50, rng), std::vector<uint8_t>(150, 0),
                              std::vector<uint8_t>(150, 255), std::vector<uint8_t>{0, 0, 1}})
    for (auto method : {Method::qdmd, Method::dmd}) {
      auto options = live_of(6);
      options.method = method;
      Strip strip(picture.size() / 3, options);
      for (int t = 0; t < 40; ++t) {
        strip.push(picture);
        ASSERT_EQ(strip.pop(Output::background), picture) << t;
      }
    }
}

// ---- One in, one out ----

TEST(EngineLive, PushWhileAFrameIsWaitingIsRefused) {
  std::mt19937 rng(307);
  Strip strip(20, live_of(5));
  const auto frame = random_picture(20, rng);
  EXPECT_TRUE(strip.push(frame).ok());
  EXPECT_EQ(strip.push(frame).code, Status::Code::frames_are_waiting);
  EXPECT_EQ(strip.engine.report().pending, 1);
  EXPECT_EQ(strip.pop(Output::background), frame);
  EXPECT_TRUE(strip.push(frame).ok());
  strip.engine.flush();
  EXPECT_FALSE(strip.engine.next());
  EXPECT_EQ(strip.engine.report().pending, 0);
  EXPECT_TRUE(strip.push(frame).ok()) << "flush drops the frame that waits";
}

TEST(EngineLive, RunDrainsToNothing) {
  std::mt19937 rng(308);
  for (size_t count : {1, 2, 3, 17}) {
    const Clip clip = random_clip(20, count, rng);
    Strip strip(20, live_of(5));
    EXPECT_EQ(strip.run(clip, Output::background).size(), count);
    EXPECT_FALSE(strip.engine.next()) << "drain() has nothing to give";
  }
}

// ---- Threads ----

TEST(Engine, ThreadsChangeNoByte) {
  std::mt19937 rng(309);
  // Several bands of rows and parts of products for each thread.
  const int width = 401, height = 250;
  std::vector<std::vector<uint8_t>> frames;
  for (int t = 0; t < 14; ++t)
    frames.push_back(random_picture(static_cast<size_t>(width * height), rng));
  for (Mode mode : {Mode::batch, Mode::live})
    for (Output output : {Output::background, Output::cutout}) {
      std::vector<std::vector<uint8_t>> expected;
      for (int threads : {1, 2, 3, 0}) {
        EngineOptions options = live_of(6, 2);
        options.mode = mode;
        options.threads = threads;
        Engine engine;
        ASSERT_TRUE(engine.configure(options, width, height).ok());
        std::vector<std::vector<uint8_t>> all;
        const auto take = [&] {
          while (engine.next()) {
            PackedPicture picture(width, height, 3);
            engine.next()->pop(output, picture.out());
            all.push_back(picture.bytes);
          }
        };
        for (const auto& frame : frames) {
          PackedPicture picture(width, height, 3);
          picture.fill(frame);
          ASSERT_TRUE(engine.push(picture.in()).ok());
          take();
        }
        engine.drain();
        take();
        ASSERT_EQ(all.size(), frames.size());
        if (threads == 1) expected = all;
        ASSERT_TRUE(all == expected) << threads << " threads, mode " << static_cast<int>(mode);
      }
    }
}

// ---- Whole pictures ----

// Many rows are written in bands, each row in several runs.
TEST(EngineLive, LargePicturesWithAndWithoutGaps) {
  std::mt19937 rng(314);
  constexpr int kWidth = 1301, kHeight = 97;
  const Clip clip = random_clip(static_cast<size_t>(kWidth * kHeight), 4, rng);
  for (int padding : {0, 7})
    for (int bytes : {3, 4}) {
      auto options = live_of(3, 1);
      options.threads = 2;
      options.foreground_threshold = 120;
      Engine engine;
      ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
      for (size_t t = 0; t < 4; ++t) {
        PackedPicture in(kWidth, kHeight, bytes, false, padding),
            out(kWidth, kHeight, bytes, false, padding);
        in.fill(clip.frames[t]);
        ASSERT_TRUE(engine.push(in.in()).ok());
        engine.next()->pop(kOutputs[t], out.out());
        const size_t size = std::min<size_t>(t + 1, 3);
        FreshModel model(part_of(clip, t + 1 - size, size), options);
        const auto background = model.background(static_cast<double>(size - 1));
        ASSERT_TRUE(out.planes() == picture_of(clip.frames[t], background, kOutputs[t], 120))
            << bytes << " bytes a pixel, gap " << padding << ", frame " << t;
        // What lies between the rows is not ours.
        for (int row = 0; row < kHeight; ++row)
          for (int i = 0; i < padding; ++i)
            ASSERT_EQ(out.bytes[static_cast<size_t>((row + 1) * out.row_stride - 1 - i)],
                      kUntouched);
      }
    }
}

TEST(EngineLive, AlphaGoesWithItsFrame) {
  std::mt19937 rng(315);
  constexpr int kWidth = 75, kHeight = 3;
  auto options = live_of(4, 2);
  options.foreground_threshold = 60;
  Engine engine;
  ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  for (int t = 0; t < 24; ++t) {
    PackedPicture in(kWidth, kHeight, 4, true), out(kWidth, kHeight, 4, true);
    for (uint8_t& byte : in.bytes) byte = static_cast<uint8_t>(rng() >> 9);
    const auto constant = static_cast<uint8_t>(10 * t);
    // Alpha that varies, that is constant, and that varies in the last pixel only.
    for (size_t p = 0; p < in.pixels() && t % 3 > 0; ++p) in.at(3, p) = constant;
    if (t % 3 == 2) in.at(3, in.pixels() - 1) ^= 1;
    ASSERT_TRUE(engine.push(in.in()).ok());
    engine.next()->pop(kOutputs[t % 4], out.out());
    for (size_t p = 0; p < in.pixels(); ++p) {
      const bool hidden =
          kOutputs[t % 4] == Output::cutout && out.at(3, p) == 0 && out.at(0, p) == 0;
      ASSERT_TRUE(hidden || out.at(3, p) == in.at(3, p)) << "frame " << t << ", pixel " << p;
    }
  }
}

// ---- Breaks in time ----

TEST(EngineLive, DrainKeepsTheBackgroundUntilThereIsANewModel) {
  std::mt19937 rng(310);
  const Clip clip = busy_clip(60, 50, rng);
  const auto options = live_of(10, 4);
  Strip strip(clip.pixels, options);
  std::vector<uint8_t> last;
  for (size_t t = 0; t < 23; ++t) {
    strip.push(clip.frames[t]);
    last = strip.pop(Output::background);
  }
  const uint64_t solves = strip.engine.report().solves;
  ASSERT_TRUE(strip.engine.drain().ok());
  EXPECT_FALSE(strip.engine.next());
  // A window of its own, whose first solve comes after a hop.
  FreshModel first(part_of(clip, 23, 4), options);
  std::vector<uint8_t> kept;
  for (size_t t = 23; t < 27; ++t) {
    strip.push(clip.frames[t]);
    const auto picture = strip.pop(Output::background);
    if (t == 23) kept = picture;
    if (t < 26) {
      EXPECT_EQ(picture, kept) << t;
    } else {
      EXPECT_EQ(picture, first.background(3)) << t;
      EXPECT_NE(picture, kept);
    }
  }
  EXPECT_EQ(strip.engine.report().solves, solves + 1);
  EXPECT_EQ(strip.engine.report().solve.window_frames, 4);
  // The sums of frozen pictures begin without the half: their last bit may round otherwise.
  size_t differ = 0;
  for (size_t i = 0; i < last.size(); ++i) {
    EXPECT_LE(std::abs(last[i] - kept[i]), 1);
    differ += last[i] != kept[i];
  }
  EXPECT_LE(differ, 1u);
}

TEST(EngineLive, ManyDrainsNeedNoModel) {
  std::mt19937 rng(311);
  Strip strip(20, live_of(10, 4));
  EXPECT_TRUE(strip.engine.drain().ok());
  EXPECT_TRUE(strip.engine.drain().ok());
  std::vector<uint8_t> first;
  // Never a whole hop between two drains: the first frame stays the background.
  for (int t = 0; t < 30; ++t) {
    const auto frame = random_picture(20, rng);
    ASSERT_TRUE(strip.push(frame).ok());
    const auto picture = strip.pop(Output::background);
    if (t == 0) first = picture;
    EXPECT_EQ(picture, first) << t;
    if (t % 3 == 0) strip.engine.drain();
  }
  EXPECT_EQ(strip.engine.report().solves, 1u);
}

TEST(EngineLive, FlushForgets) {
  std::mt19937 rng(312);
  const Clip clip = busy_clip(40, 30, rng), other = busy_clip(40, 30, rng);
  const auto options = live_of(8, 3);
  Strip strip(40, options), fresh(40, options);
  for (size_t t = 0; t < 17; ++t) {
    strip.push(clip.frames[t]);
    strip.pop(Output::background);
  }
  strip.engine.drain();
  strip.engine.flush();
  EXPECT_EQ(strip.run(other, Output::background), fresh.run(other, Output::background));
}

TEST(EngineLive, ConfigureStartsAfresh) {
  std::mt19937 rng(313);
  const Clip clip = busy_clip(50, 20, rng);
  Strip strip(30, live_of(5));
  for (int t = 0; t < 13; ++t) {
    strip.push(random_picture(30, rng));
    strip.pop(Output::background);
  }
  const auto options = live_of(6, 2);
  ASSERT_TRUE(strip.engine.configure(options, 50, 1).ok());
  EXPECT_EQ(strip.engine.report().solves, 0u);
  EXPECT_EQ(strip.engine.report().solve.window_frames, 0);
  strip.width = 50;
  Strip fresh(50, options);
  EXPECT_EQ(strip.run(clip, Output::background), fresh.run(clip, Output::background));
  // And to batch and back.
  ASSERT_TRUE(strip.engine.configure(window_of(6), 50, 1).ok());
  Strip batch(50, window_of(6));
  EXPECT_EQ(strip.run(clip, Output::background), batch.run(clip, Output::background));
  ASSERT_TRUE(strip.engine.configure(options, 50, 1).ok());
  Strip again(50, options);
  EXPECT_EQ(strip.run(clip, Output::background), again.run(clip, Output::background));
}

TEST(EngineLive, HopSizesOutsideTheWindowAreRefused) {
  for (int hop : {-1, 6, 2048}) {
    Engine engine;
    const Status status = engine.configure(live_of(5, hop), 4, 4);
    EXPECT_EQ(status.code, Status::Code::invalid_options) << hop;
    EXPECT_NE(status.message.find("hop-size"), std::string::npos) << status.message;
  }
  for (int hop : {0, 1, 5}) {
    Engine engine;
    EXPECT_TRUE(engine.configure(live_of(5, hop), 4, 4).ok()) << hop;
  }
}

}  // namespace
}  // namespace qdmd::test
