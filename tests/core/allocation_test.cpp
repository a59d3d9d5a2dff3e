// SPDX-License-Identifier: LGPL-2.1-or-later
// Counts what the engine allocates: after its start, nothing for a frame that begins no solve.
#include "tests/core/allocator.h"
#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

class Allocations : public testing::Test {
 protected:
  void SetUp() override {
    if (!allocator::sees_all()) GTEST_SKIP() << "no allocator of our own";
  }
};

// What `work` allocates, on any thread.
template <typename Work>
int64_t allocations_of(Work work) {
  allocator::start();
  work();
  allocator::stop();
  return allocator::seen().allocations;
}

// Counts where there should be none, and says where the first one came from (addr2line -e).
template <typename Work>
int64_t unwanted_of(Work work) {
  const int64_t count = allocations_of(work);
  if (count > 0) allocator::print_first();
  return count;
}

TEST_F(Allocations, AreSeen) {
  std::unique_ptr<int> kept;  // A pair of new and delete may be left out.
  EXPECT_GT(allocations_of([&] { kept = std::make_unique<int>(3); }), 0);
  EXPECT_GT(allocations_of([] {
              ::operator delete(::operator new(5, std::align_val_t(64)), std::align_val_t(64));
            }),
            0);
  EXPECT_GT(allocations_of([] { Eigen::MatrixXd::Random(9, 9).eval(); }), 0);
  EXPECT_GT(allocations_of([] { std::thread([] {}).join(); }), 0);
  EXPECT_EQ(allocations_of([] {}), 0);
}

enum class Alpha { none, constant, varying };

// An engine, frames and a picture that need no memory of their own while it counts.
struct Steady {
  static constexpr int kWidth = 240, kHeight = 160;
  Engine engine;
  Wishes wishes;
  std::vector<PackedPicture> frames;
  PackedPicture out;

  Steady(const EngineOptions& options, Alpha alpha, std::mt19937& rng)
      : out(kWidth, kHeight, alpha == Alpha::none ? 3 : 4, alpha != Alpha::none) {
    EngineOptions soft = options;
    soft.mask_softness = 2;
    EXPECT_TRUE(engine.configure(soft, kWidth, kHeight).ok());
    wishes = first_wishes(soft);
    wishes.ignored.add({10, 10, 50, 50});
    for (int k = 0; k < 7; ++k) {
      frames.emplace_back(kWidth, kHeight, out.bytes_per_pixel, out.with_alpha);
      for (uint8_t& byte : frames.back().bytes) byte = static_cast<uint8_t>(rng() >> 9);
      if (alpha == Alpha::constant)
        for (size_t p = 0; p < out.pixels(); ++p) frames.back().at(3, p) = 200;
    }
  }
  void push(int t) { engine.push(frames[static_cast<size_t>(t) % frames.size()].in(), &wishes); }
  void pop(int t) {
    while (engine.next(&wishes)) engine.next()->pop(static_cast<Output>(t % 4), out.out());
  }
};

std::string describe(Method method, int threads, Alpha alpha, double omega) {
  return (method == Method::robust ? "robust, " : "qdmd, ") + std::to_string(threads) +
         " threads, alpha " + std::to_string(static_cast<int>(alpha)) + ", omega-threshold " +
         std::to_string(omega);
}

// The default as users get it, or plain Q-DMD.
EngineOptions options_of(Method method, int window) {
  EngineOptions options;
  options.method = method;
  options.window_size = window;
  return options;
}

template <typename Check>
void for_every_kind(Check check) {
  for (Method method : {Method::robust, Method::qdmd})
    for (int threads : {1, 2})
      for (Alpha alpha : {Alpha::none, Alpha::constant, Alpha::varying})
        for (double omega : {0.0, kInfinity}) {
          if (method == Method::robust && omega > 0) continue;
          SCOPED_TRACE(describe(method, threads, alpha, omega));
          check(method, threads, alpha, omega);
        }
}

TEST_F(Allocations, BatchFramesThatCompleteNoWindow) {
  std::mt19937 rng(361);
  for_every_kind([&](Method method, int threads, Alpha alpha, double omega) {
    constexpr int kWindow = 40;
    auto options = options_of(method, kWindow);
    options.threads = threads;
    options.dmd.omega_threshold = omega;
    Steady steady(options, alpha, rng);
    // Start: one window, after which each slot has its alpha samples' memory.
    for (int t = 0; t < kWindow; ++t) steady.push(t), steady.pop(t);
    for (int t = 0; t < 2 * kWindow; ++t) {
      const bool solves = t % kWindow == kWindow - 1;
      const auto push = [&] { steady.push(t); };
      const int64_t pushed = solves ? allocations_of(push) : unwanted_of(push);
      EXPECT_TRUE(solves || pushed == 0) << pushed << " to push frame " << t;
      EXPECT_TRUE(steady.engine.next()) << "one leaves for each that comes";
      EXPECT_EQ(steady.engine.report().pending, kWindow);
      EXPECT_EQ(unwanted_of([&] { steady.pop(t); }), 0) << "to pop after frame " << t;
    }
  });
}

// A solve that goes on beside the frames has memory of its own: the frames' thread is looked at.
TEST_F(Allocations, LiveFramesThatBeginAndEndNoSolve) {
  std::mt19937 rng(362);
  for_every_kind([&](Method method, int threads, Alpha alpha, double omega) {
    for (int step : {1, 2}) {
      EngineOptions options = options_of(method, 20);
      options.mode = Mode::live;
      options.hop_size = 5;
      options.threads = threads;
      options.sample_step = step;
      options.dmd.omega_threshold = omega;
      Steady steady(options, alpha, rng);
      for (int t = 0; t < 45; ++t) steady.push(t), steady.pop(t);
      allocator::see_only_this_thread(threads > 1);
      int quiet = 0;
      for (int t = 0; t < 30; ++t) {
        const uint64_t solves = steady.engine.report().solves;
        // The schedule's, and where there is no other thread, all of the solve is done there.
        const bool begins = threads == 1 && method == Method::robust && t % 5 == 2;
        const int64_t pushed = allocations_of([&] { steady.push(t); });
        const bool solved = begins || steady.engine.report().solves > solves;
        if (pushed > 0 && !solved) allocator::print_first();
        EXPECT_TRUE(solved || pushed == 0) << pushed << " to push frame " << t;
        quiet += !solved;
        EXPECT_EQ(unwanted_of([&] { steady.pop(t); }), 0) << "to pop frame " << t;
      }
      allocator::see_only_this_thread(false);
      EXPECT_GE(quiet, 18);
    }
  });
}

TEST_F(Allocations, FrozenFrames) {
  std::mt19937 rng(363);
  for (Method method : {Method::robust, Method::qdmd})
    for (Mode mode : {Mode::batch, Mode::live}) {
      EngineOptions options = options_of(method, 10);
      options.mode = mode;
      Steady steady(options, Alpha::constant, rng);
      for (int t = 0; t < 20; ++t) steady.push(t), steady.pop(t);
      steady.wishes.freeze = true;
      for (int t = 0; t < 10; ++t) steady.push(t), steady.pop(t);
      for (int t = 0; t < 25; ++t) {
        const int64_t count = unwanted_of([&] {
          steady.push(t);
          steady.pop(t);
        });
        EXPECT_EQ(count, 0) << "frame " << t;
      }
    }
}

TEST_F(Allocations, FlushAndDrainOfNothing) {
  std::mt19937 rng(364);
  for (Method method : {Method::robust, Method::qdmd}) {
    Steady steady(options_of(method, 10), Alpha::none, rng);
    for (int t = 0; t < 25; ++t) steady.push(t), steady.pop(t);
    EXPECT_EQ(unwanted_of([&] {
                steady.engine.flush();
                steady.engine.drain();
              }),
              0);
  }
}

// What is frozen has three pictures, however few the model has: max-memory counts no more than
// that, and none of them twice.
TEST_F(Allocations, FreezingAModelTakesNoPicture) {
  constexpr size_t kPixels = 5000;
  std::mt19937 rng(365);
  const Clip clip = random_clip(kPixels, 4, rng);
  const Window window = to_window(clip);
  for (int modes : {0, 1, 2, 3}) {
    TemporalModel temporal(4);
    for (int c = 0; c < modes; ++c)
      temporal.add_channel_mode(c, Eigen::VectorXcd::Constant(4, 0.25), 1.0, 0, 1.0);
    BackgroundModel model;
    model.build(window, temporal);
    allocator::start();
    model.freeze_at(2);
    allocator::stop();
    EXPECT_LT(allocator::seen().peak, int64_t{kPixels}) << modes << " pictures";
  }
}

}  // namespace
}  // namespace qdmd::test
