// SPDX-License-Identifier: LGPL-2.1-or-later
// Batch with windows that are solved while the next frames come: the same pictures as of windows
// that are solved at once, later.
#include "tests/core/engine_util.h"
#include "tests/core/live_util.h"

namespace qdmd::test {
namespace {

using Pictures = std::vector<std::vector<uint8_t>>;

constexpr size_t kPixels = 150;

struct Kind {
  const char* name;
  Method method;
  int window;
  double omega;
  double rate;  // high enough that frames come during a solve
};

const Kind kKinds[] = {
    {"robust", Method::robust, 12, 0, 1e4},
    {"robust, short", Method::robust, 5, 0, 1e9},
    {"qdmd", Method::qdmd, 12, 0, 1e4},
    {"qdmd, as late as can be", Method::qdmd, 12, 0, 1e9},
    {"qdmd, two frames", Method::qdmd, 2, 0, 1e9},
    {"qdmd whose models read frames", Method::qdmd, 4, 0.3, 1e9},
    {"qdmd of all modes", Method::qdmd, 9, kInfinity, 1e9},
    {"dmd", Method::dmd, 8, 0, 1e9},
};

EngineOptions options_of(const Kind& kind, int threads) {
  EngineOptions options;
  options.method = kind.method;
  options.window_size = kind.window;
  options.dmd.omega_threshold = kind.omega;
  options.threads = threads;
  return options;
}

// An engine that is looked at with each call.
class Watched {
 public:
  Watched(const EngineOptions& options, Output output)
      : options_(options),
        layout_(layout_of(options, kPixels, 1)),
        output_(output),
        strip_(kPixels, options) {
    EXPECT_EQ(strip_.engine.report().delay, options.window_size - 1 + layout_.late_frames);
  }
  Engine& engine() { return strip_.engine; }
  Wishes& wishes() { return strip_.wishes; }
  int late_frames() const { return layout_.late_frames; }
  const EngineLayout& layout() const { return layout_; }

  void push(const std::vector<uint8_t>& frame) {
    ASSERT_TRUE(strip_.push(frame).ok());
    ++in_;
    // From the frame after the delay on, exactly one.
    const bool leaves = in_ > strip_.engine.report().delay;
    ASSERT_EQ(strip_.engine.next() != nullptr, leaves);
    ASSERT_EQ(strip_.engine.report().pending, in_ - out_);
    if (leaves) {
      EXPECT_EQ(strip_.engine.report().frames_left, end_of_window(out_) - out_);
      pop(in_ + options_.window_size);
    }
    ASSERT_FALSE(strip_.engine.next());
    ASSERT_EQ(strip_.engine.report().pending, std::min(in_, strip_.engine.report().delay));
    if (out_ == 0) {
      EXPECT_EQ(strip_.engine.report().frames_left, 0);
    }
  }
  void drain() {
    ASSERT_TRUE(strip_.engine.drain().ok());
    ASSERT_EQ(strip_.engine.report().pending, in_ - out_);
    while (out_ < in_) {
      ASSERT_TRUE(strip_.engine.next());
      pop(in_);
    }
    EXPECT_FALSE(strip_.engine.next());
    EXPECT_EQ(strip_.engine.report().pending, 0);
    EXPECT_EQ(strip_.engine.report().frames_left, 0);
    in_ = out_ = 0;
  }
  void flush() {
    strip_.engine.flush();
    EXPECT_FALSE(strip_.engine.next());
    EXPECT_EQ(strip_.engine.report().pending, 0);
    EXPECT_EQ(strip_.engine.report().frames_left, 0);
    in_ = out_ = 0;
    pictures.clear();
  }

  Pictures pictures;

 private:
  int end_of_window(int frame) const {
    return (frame / options_.window_size + 1) * options_.window_size;
  }
  // end: where the last window ends.
  void pop(int end) {
    pictures.push_back(strip_.pop(output_));
    ++out_;
    EXPECT_EQ(strip_.engine.report().frames_left, std::min(end, end_of_window(out_ - 1)) - out_);
  }

  EngineOptions options_;
  EngineLayout layout_;
  Output output_;
  Strip strip_;
  int in_ = 0, out_ = 0;  // since time broke
};

// Two engines that see the same: one has no time for a solve, the other all of it.
class Both {
 public:
  Both(const Kind& kind, int threads, Output output = Output::background)
      : at_once(options_of(kind, threads), output), paced(late(kind, threads), output) {
    EXPECT_EQ(at_once.late_frames(), 0);
    EXPECT_GT(paced.late_frames(), 0);
    EXPECT_LE(paced.late_frames(), kind.window / 2);
    // Models that read frames have them for as long as they are in use.
    if (kind.omega > 0) {
      EXPECT_EQ(paced.layout().capacity, 2 * kind.window + paced.late_frames());
    }
  }
  static EngineOptions late(const Kind& kind, int threads) {
    EngineOptions options = options_of(kind, threads);
    options.frame_rate = kind.rate;
    return options;
  }
  template <typename Action>
  void each(Action action) {
    action(at_once);
    action(paced);
  }
  void push(const std::vector<uint8_t>& frame) {
    each([&](Watched& engine) { engine.push(frame); });
  }
  void set_freeze(bool freeze) {
    each([&](Watched& engine) { engine.wishes().freeze = freeze; });
  }
  // After which all can be compared.
  void drain() {
    each([](Watched& engine) { engine.drain(); });
    compare();
  }
  void compare() {
    ASSERT_EQ(at_once.pictures.size(), paced.pictures.size());
    for (size_t t = 0; t < paced.pictures.size(); ++t)
      ASSERT_EQ(at_once.pictures[t], paced.pictures[t]) << "frame " << t;
    EXPECT_EQ(at_once.engine().report().solves, paced.engine().report().solves);
    const SolveReport a = at_once.engine().report().solve, b = paced.engine().report().solve;
    EXPECT_EQ(a.window_frames, b.window_frames);
    EXPECT_EQ(a.foreground.threshold, b.foreground.threshold);
    EXPECT_EQ(a.foreground.ratio, b.foreground.ratio);
    PackedPicture newest[2] = {{kPixels, 1}, {kPixels, 1}};
    const bool known = at_once.engine().write_background(newest[0].out());
    EXPECT_EQ(known, paced.engine().write_background(newest[1].out()));
    EXPECT_EQ(newest[0].planes(), newest[1].planes());
  }

  Watched at_once, paced;
};

template <typename Check>
void for_every_kind(Check check) {
  for (const Kind& kind : kKinds)
    for (int threads : {1, 3}) {
      SCOPED_TRACE(std::string(kind.name) + ", " + std::to_string(threads) + " threads");
      check(kind, threads);
      if (testing::Test::HasFatalFailure()) return;
    }
}

// Around one window, two, and the frames that come during a solve.
std::vector<int> lengths_of(int window, int late) {
  return {1,
          window - 1,
          window,
          window + 1,
          window + late - 1,
          window + late,
          window + late + 1,
          2 * window - 1,
          2 * window,
          2 * window + 1,
          2 * window + late,
          3 * window + 2};
}

TEST(Pacing, StreamsOfAnyLengthHaveTheSamePictures) {
  std::mt19937 rng(371);
  for_every_kind([&](const Kind& kind, int threads) {
    const Clip clip = moving_box_clip(kPixels, 60, 20, rng);
    for (Output output : {Output::background, Output::mask}) {
      const int late = layout_of(Both::late(kind, threads), kPixels, 1).late_frames;
      for (int length : lengths_of(kind.window, late)) {
        SCOPED_TRACE("length " + std::to_string(length));
        Both both(kind, threads, output);
        for (int t = 0; t < length; ++t) both.push(clip.frames[static_cast<size_t>(t)]);
        both.drain();
        ASSERT_EQ(both.paced.pictures.size(), static_cast<size_t>(length));
      }
    }
  });
}

TEST(Pacing, ADrainAtAnyFrame) {
  std::mt19937 rng(372);
  for_every_kind([&](const Kind& kind, int threads) {
    const Clip clip = moving_box_clip(kPixels, 80, 20, rng);
    const int window = kind.window;
    for (int first = 0; first <= 2 * window + 2; ++first)
      for (int second : {1, window - 1, window + 1, 2 * window}) {
        SCOPED_TRACE(std::to_string(first) + " frames, then " + std::to_string(second));
        Both both(kind, threads);
        for (int t = 0; t < first; ++t) both.push(clip.frames[static_cast<size_t>(t)]);
        both.drain();
        for (int t = 0; t < second; ++t) both.push(clip.frames[static_cast<size_t>(first + t)]);
        both.drain();
        ASSERT_EQ(both.paced.pictures.size(), static_cast<size_t>(first + second));
      }
  });
}

TEST(Pacing, AFreezeOnAndOffAtAnyFrame) {
  std::mt19937 rng(373);
  for_every_kind([&](const Kind& kind, int threads) {
    const Clip clip = moving_box_clip(kPixels, 60, 20, rng);
    const int window = kind.window, step = std::max(1, window / 4);
    for (int on = 0; on <= 2 * window + 1; on += step)
      for (int off = on + 1; off <= on + 2 * window; off += step) {
        SCOPED_TRACE("frozen from " + std::to_string(on) + " to " + std::to_string(off));
        Both both(kind, threads);
        for (int t = 0; t < 4 * window + 1; ++t) {
          if (t == on) both.set_freeze(true);
          if (t == off) both.set_freeze(false);
          both.push(clip.frames[static_cast<size_t>(t)]);
        }
        both.drain();
      }
  });
}

TEST(Pacing, DrainsAndFreezesInAnyOrder) {
  std::mt19937 rng(374);
  for_every_kind([&](const Kind& kind, int threads) {
    const Clip clip = moving_box_clip(kPixels, 60, 20, rng);
    for (int round = 0; round < 10; ++round) {
      SCOPED_TRACE("round " + std::to_string(round));
      Both both(kind, threads);
      for (const auto& frame : clip.frames) {
        if (rng() % 7 == 0) both.set_freeze(rng() % 2 == 0);
        if (rng() % 17 == 0) both.drain();
        both.push(frame);
      }
      both.drain();
    }
  });
}

TEST(Pacing, AFlushAtAnyFrameForgetsEverything) {
  std::mt19937 rng(375);
  for_every_kind([&](const Kind& kind, int threads) {
    const Clip clip = moving_box_clip(kPixels, 80, 20, rng);
    const auto window = static_cast<size_t>(kind.window);
    Watched fresh(Both::late(kind, threads), Output::background);
    for (size_t t = 0; t < 2 * window + 1; ++t) fresh.push(clip.frames[t]);
    fresh.drain();
    for (bool drained : {false, true}) {
      Watched engine(Both::late(kind, threads), Output::background);
      for (size_t before = 0; before <= 2 * window + 3; ++before) {
        SCOPED_TRACE(std::to_string(before) + " frames before");
        engine.wishes().freeze = before % 3 == 1;
        for (size_t t = 0; t < before; ++t) engine.push(clip.frames[79 - t]);
        // Also with frames that are ready.
        if (drained) {
          ASSERT_TRUE(engine.engine().drain().ok());
        }
        engine.flush();
        engine.wishes().freeze = false;
        for (size_t t = 0; t < 2 * window + 1; ++t) engine.push(clip.frames[t]);
        engine.drain();
        ASSERT_EQ(engine.pictures, fresh.pictures);
        engine.flush();
      }
    }
  });
}

// As many as come meanwhile.
TEST(Pacing, FramesOfASolveAreItsTimeTimesTheRate) {
  EngineOptions options;
  options.method = Method::qdmd;
  options.window_size = 100;
  const auto late = [&](double rate, int width, int height) {
    options.frame_rate = rate;
    return layout_of(options, width, height).late_frames;
  };
  // The solve of such a window takes 0.02 s, and has four times as long.
  EXPECT_EQ(late(24, 8, 8), 2);
  EXPECT_EQ(late(49, 8, 8), 4);
  EXPECT_EQ(late(99, 8, 8), 8);
  EXPECT_EQ(late(1e6, 1, 1), options.window_size / 4);
  // Solves that take a small part of a frame's time are done at once.
  EXPECT_EQ(late(10, 8, 8), 0);
  options.window_size = 20;
  EXPECT_EQ(late(25, 320, 240), 0);
}

// Where there is no room for the frames that come during a solve, it has less time.
TEST(Pacing, LittleMemoryTakesFromTheFramesOfASolve) {
  auto options = Both::late(kKinds[0], 1);
  const EngineLayout most = layout_of(options, kPixels, 1);
  options.frame_rate = 0;
  const EngineLayout least = layout_of(options, kPixels, 1);
  ASSERT_GT(most.late_frames, 1);
  ASSERT_LT(least.bytes, most.bytes);
  options.frame_rate = kKinds[0].rate;
  options.max_memory = most.bytes - 1;
  const EngineLayout some = layout_of(options, kPixels, 1);
  EXPECT_LT(some.late_frames, most.late_frames);
  EXPECT_LE(some.bytes, options.max_memory);
  options.max_memory = least.bytes;
  EXPECT_EQ(layout_of(options, kPixels, 1).late_frames, 0);
  Strip strip(kPixels, options);
  EXPECT_EQ(strip.engine.report().delay, options.window_size - 1);
}

// Live frames wait for none.
TEST(Pacing, LiveHasNoDelay) {
  auto options = Both::late(kKinds[0], 1);
  options.mode = Mode::live;
  EXPECT_EQ(layout_of(options, kPixels, 1).delay, 0);
  EXPECT_EQ(Strip(kPixels, options).engine.report().delay, 0);
}

}  // namespace
}  // namespace qdmd::test
