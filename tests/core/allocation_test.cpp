// Counts what the engine allocates: after its start, nothing for a frame that begins no solve.
#include <execinfo.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>

#include "tests/core/engine_util.h"

// Everything comes through here: operator new, Eigen, std::function. The C library's own functions
// do the work. Not under sanitizers, which replace the same names.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define QDMD_COUNTS_ALLOCATIONS 1

namespace {

std::atomic<bool> counting = false;
std::atomic<int> allocations = 0;
void* first_stack[32];
int first_depth = 0;

void count_one() {
  if (!counting || allocations.fetch_add(1) > 0) return;
  counting = false;
  first_depth = backtrace(first_stack, 32);
  counting = true;
}

}  // namespace

extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

void* malloc(size_t size) {
  count_one();
  return __libc_malloc(size);
}
void* calloc(size_t count, size_t size) {
  count_one();
  return __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
  count_one();
  return __libc_realloc(old, size);
}
void* memalign(size_t alignment, size_t size) {
  count_one();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  count_one();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, size_t alignment, size_t size) {
  count_one();
  *out = __libc_memalign(alignment, size);
  return *out ? 0 : ENOMEM;
}
}
#endif

namespace qdmd::test {
namespace {

#if QDMD_COUNTS_ALLOCATIONS

// What `work` allocates, on any thread.
template <typename Work>
int allocations_of(Work work) {
  allocations = 0;
  counting = true;
  work();
  counting = false;
  return allocations;
}

// The same where there should be none: says where the first one came from (addr2line -e).
template <typename Work>
int unwanted_of(Work work) {
  const int count = allocations_of(work);
  if (count > 0) backtrace_symbols_fd(first_stack, first_depth, STDERR_FILENO);
  return count;
}

TEST(Allocations, AreSeen) {
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
  std::vector<Picture> frames;
  Picture out;

  Steady(const EngineOptions& options, Alpha alpha, std::mt19937& rng)
      : out(kWidth, kHeight, alpha == Alpha::none ? 3 : 4, alpha != Alpha::none) {
    EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
    for (int k = 0; k < 7; ++k) {
      frames.emplace_back(kWidth, kHeight, out.bytes_per_pixel, out.with_alpha);
      for (uint8_t& byte : frames.back().bytes) byte = static_cast<uint8_t>(rng() >> 9);
      if (alpha == Alpha::constant)
        for (size_t p = 0; p < out.pixels(); ++p) frames.back().at(3, p) = 200;
    }
  }
  void push(int t) { engine.push(frames[static_cast<size_t>(t) % frames.size()].in()); }
  void pop(int t) {
    while (engine.ready()) engine.pop(static_cast<Output>(t % 4), out.out());
  }
};

std::string describe(int threads, Alpha alpha, double omega) {
  return std::to_string(threads) + " threads, alpha " + std::to_string(static_cast<int>(alpha)) +
         ", omega-threshold " + std::to_string(omega);
}

template <typename Check>
void for_every_kind(Check check) {
  for (int threads : {1, 2})
    for (Alpha alpha : {Alpha::none, Alpha::constant, Alpha::varying})
      for (double omega : {0.0, kInfinity}) {
        SCOPED_TRACE(describe(threads, alpha, omega));
        check(threads, alpha, omega);
      }
}

TEST(Allocations, BatchFramesThatCompleteNoWindow) {
  std::mt19937 rng(361);
  for_every_kind([&](int threads, Alpha alpha, double omega) {
    constexpr int kWindow = 40;
    auto options = window_of(kWindow);
    options.threads = threads;
    options.dmd.omega_threshold = omega;
    Steady steady(options, alpha, rng);
    // Start: one window, after which each slot has its alpha samples' memory.
    for (int t = 0; t < kWindow; ++t) steady.push(t), steady.pop(t);
    for (int t = 0; t < 2 * kWindow; ++t) {
      const bool solves = t % kWindow == kWindow - 1;
      const auto push = [&] { steady.push(t); };
      const int pushed = solves ? allocations_of(push) : unwanted_of(push);
      EXPECT_TRUE(solves || pushed == 0) << pushed << " to push frame " << t;
      EXPECT_EQ(steady.engine.ready(), solves);
      EXPECT_EQ(unwanted_of([&] { steady.pop(t); }), 0) << "to pop after frame " << t;
    }
  });
}

TEST(Allocations, LiveFramesThatBeginNoSolve) {
  std::mt19937 rng(362);
  for_every_kind([&](int threads, Alpha alpha, double omega) {
    for (int step : {1, 2}) {
      EngineOptions options = window_of(20);
      options.mode = Mode::live;
      options.hop_size = 5;
      options.threads = threads;
      options.sample_step = step;
      options.dmd.omega_threshold = omega;
      Steady steady(options, alpha, rng);
      for (int t = 0; t < 45; ++t) steady.push(t), steady.pop(t);
      int quiet = 0;
      for (int t = 0; t < 30; ++t) {
        const uint64_t solves = steady.engine.solves();
        const int pushed = allocations_of([&] { steady.push(t); });
        EXPECT_TRUE(steady.engine.solves() > solves || pushed == 0)
            << pushed << " to push frame " << t;
        quiet += steady.engine.solves() == solves;
        EXPECT_EQ(unwanted_of([&] { steady.pop(t); }), 0) << "to pop frame " << t;
      }
      EXPECT_EQ(quiet, 24);
    }
  });
}

TEST(Allocations, FrozenFrames) {
  std::mt19937 rng(363);
  for (Mode mode : {Mode::batch, Mode::live}) {
    EngineOptions options = window_of(10);
    options.mode = mode;
    Steady steady(options, Alpha::constant, rng);
    for (int t = 0; t < 20; ++t) steady.push(t), steady.pop(t);
    steady.engine.set_freeze(true);
    for (int t = 0; t < 10; ++t) steady.push(t), steady.pop(t);
    for (int t = 0; t < 25; ++t) {
      const int count = unwanted_of([&] {
        steady.push(t);
        steady.pop(t);
      });
      EXPECT_EQ(count, 0) << "frame " << t;
    }
  }
}

TEST(Allocations, FlushAndDrainOfNothing) {
  std::mt19937 rng(364);
  Steady steady(window_of(10), Alpha::none, rng);
  for (int t = 0; t < 25; ++t) steady.push(t), steady.pop(t);
  EXPECT_EQ(unwanted_of([&] {
              steady.engine.flush();
              steady.engine.drain();
              steady.engine.set_foreground_threshold(30);
            }),
            0);
}

#else

TEST(Allocations, AreCountedWithGlibcAndWithoutSanitizers) { GTEST_SKIP(); }

#endif

}  // namespace
}  // namespace qdmd::test
