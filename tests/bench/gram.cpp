// The exact Gram matrix: kernels, windows, sizes and threads, in products per second, beside the
// most that the dot-product instruction does when it touches registers alone.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>
#include <string>

#include "core/gram/gram.h"

namespace {

using namespace qdmd;

constexpr int kGroup = 16;  // frames that the engine adds together

// In a register tile no product waits for the one before: so many chains.
#define QDMD_TWELVE(x) x(0) x(1) x(2) x(3) x(4) x(5) x(6) x(7) x(8) x(9) x(10) x(11)

#if defined(__x86_64__) && defined(__GNUC__)
// 12 x 64 products a round.
void peak_vnni(benchmark::State& state) {
  if (!__builtin_cpu_supports("avx512vnni")) {
    state.SkipWithError("this machine has no AVX-512 VNNI");
    return;
  }
  constexpr int kRounds = 1 << 16;
  for (auto _ : state)
    for (int i = 0; i < kRounds; ++i)
      asm volatile(
#define QDMD_DOT(n) "vpdpbusd %%zmm31, %%zmm30, %%zmm" #n "\n"
          QDMD_TWELVE(QDMD_DOT)
#undef QDMD_DOT
              ::
                  : "xmm0", "xmm1", "xmm2", "xmm3", "xmm4", "xmm5", "xmm6", "xmm7", "xmm8", "xmm9",
                    "xmm10", "xmm11");
  state.counters["GMAC/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kRounds * 12 * 64 / 1e9,
                         benchmark::Counter::kIsRate);
}

// 12 x 16 products of 16 bits a round.
void peak_avx2(benchmark::State& state) {
  if (!__builtin_cpu_supports("avx2")) {
    state.SkipWithError("this machine has no AVX2");
    return;
  }
  constexpr int kRounds = 1 << 16;
  for (auto _ : state)
    for (int i = 0; i < kRounds; ++i)
      asm volatile(
#define QDMD_DOT(n) "vpmaddwd %%ymm15, %%ymm14, %%ymm13\nvpaddd %%ymm13, %%ymm" #n ", %%ymm" #n "\n"
          QDMD_TWELVE(QDMD_DOT)
#undef QDMD_DOT
              ::
                  : "xmm0", "xmm1", "xmm2", "xmm3", "xmm4", "xmm5", "xmm6", "xmm7", "xmm8", "xmm9",
                    "xmm10", "xmm11", "xmm13");
  state.counters["GMAC/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kRounds * 12 * 16 / 1e9,
                         benchmark::Counter::kIsRate);
}
#endif

Window random_window(int frames, size_t pixels) {
  Window window(frames, pixels);
  std::mt19937_64 rng(7);
  for (int t = 0; t < frames; ++t) {
    const int slot = window.append();
    for (int c = 0; c < kChannels; ++c)
      std::generate_n(window.plane(slot, c), pixels, [&] { return static_cast<uint8_t>(rng()); });
  }
  return window;
}

// A whole window as the engine adds it: 3m (3m + 1) / 2 products a pixel are asked for.
void window_gram(benchmark::State& state, const Kernel& kernel) {
  const auto frames = static_cast<int>(state.range(0)), threads = static_cast<int>(state.range(3));
  const auto pixels = static_cast<size_t>(state.range(1)) * static_cast<size_t>(state.range(2));
  const Window full = random_window(frames, pixels);
  Window window(frames, pixels);
  Pool pool(threads);
  SlidingGram gram(frames, &pool, kernel);
  for (auto _ : state) {
    window.clear();
    for (int t = 0; t < frames; ++t) {
      state.PauseTiming();
      const int slot = window.append();
      for (int c = 0; c < kChannels; ++c)
        std::copy_n(full.plane(t, c), full.plane_size(), window.plane(slot, c));
      state.ResumeTiming();
      if (window.size() % kGroup == 0 || window.size() == frames)
        gram.add_newest(window, (window.size() - 1) % kGroup + 1);
    }
  }
  const double products = 1.5 * frames * (3.0 * frames + 1) * static_cast<double>(pixels);
  state.counters["GMAC/s"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * products / 1e9, benchmark::Counter::kIsRate);
}

void register_window(const Kernel& kernel, std::initializer_list<int64_t> arguments) {
  benchmark::RegisterBenchmark(("window/" + std::string(kernel.name)).c_str(),
                               [kernel](benchmark::State& state) { window_gram(state, kernel); })
      ->ArgNames({"m", "width", "height", "threads"})
      ->Args(arguments)
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

}  // namespace

int main(int argc, char** argv) {
#if defined(__x86_64__) && defined(__GNUC__)
  benchmark::RegisterBenchmark("peak/avx512-vnni", peak_vnni);
  benchmark::RegisterBenchmark("peak/avx2", peak_avx2);
#endif
  for (const Kernel& kernel : kernels()) {
    register_window(kernel, {25, 320, 240, 1});
    // The plain loop takes seconds for more.
    if (std::string(kernel.name) == "reference") continue;
    register_window(kernel, {100, 320, 240, 1});
    register_window(kernel, {200, 320, 240, 1});
    register_window(kernel, {200, 320, 240, 2});
    register_window(kernel, {50, 768, 576, 1});
    register_window(kernel, {20, 1920, 1080, 1});
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
