// SPDX-License-Identifier: LGPL-2.1-or-later
// The exact Gram matrix: kernels, windows, sizes, threads and slices, in products per second,
// beside the most that the dot-product instruction does when it touches registers alone.
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "core/gram/gram.h"

namespace {

using namespace qdmd;

constexpr int kGroup = 16;  // frames that the engine adds together

double seconds(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// ---- The instruction alone ----

constexpr int kRounds = 1 << 14;

// In a register tile no product waits for the one before: so many chains.
#define QDMD_TWELVE(x) x(0) x(1) x(2) x(3) x(4) x(5) x(6) x(7) x(8) x(9) x(10) x(11)
#define QDMD_CLOBBERED \
  "xmm0", "xmm1", "xmm2", "xmm3", "xmm4", "xmm5", "xmm6", "xmm7", "xmm8", "xmm9", "xmm10", "xmm11"

struct Peak {
  const char* kernel;
  double products;  // of a round
  void (*run)();    // kRounds
};

#if defined(__x86_64__) && defined(__GNUC__)
constexpr Peak kPeaks[] = {
    {"avx512-vnni", 12 * 64,
     [] {
       for (int i = 0; i < kRounds; ++i)
         asm volatile(
#define QDMD_DOT(n) "vpdpbusd %%zmm31, %%zmm30, %%zmm" #n "\n"
             QDMD_TWELVE(QDMD_DOT)
#undef QDMD_DOT
                 ::
                     : QDMD_CLOBBERED);
     }},
    {"avx-vnni", 12 * 32,
     [] {
       for (int i = 0; i < kRounds; ++i)
         asm volatile(
#define QDMD_DOT(n) "%{vex%} vpdpbusd %%ymm15, %%ymm14, %%ymm" #n "\n"
             QDMD_TWELVE(QDMD_DOT)
#undef QDMD_DOT
                 ::
                     : QDMD_CLOBBERED);
     }},
    {"avx2", 12 * 16,  // factors of 16 bits
     [] {
       for (int i = 0; i < kRounds; ++i)
         asm volatile(
#define QDMD_DOT(n) "vpmaddwd %%ymm15, %%ymm14, %%ymm13\nvpaddd %%ymm13, %%ymm" #n ", %%ymm" #n "\n"
             QDMD_TWELVE(QDMD_DOT)
#undef QDMD_DOT
                 ::
                     : QDMD_CLOBBERED, "xmm13");
     }},
};
#else
constexpr Peak kPeaks[] = {{"none", 0, [] {}}};
#endif

// Null where nobody wrote a loop for the kernel.
const Peak* peak_of(const Kernel& kernel) {
  for (const Peak& peak : kPeaks)
    if (std::string(peak.kernel) == kernel.name) return &peak;
  return nullptr;
}

double peak_gmacs(const Peak& peak) {
  const double start = seconds(CLOCK_THREAD_CPUTIME_ID);
  peak.run();
  return kRounds * peak.products / 1e9 / (seconds(CLOCK_THREAD_CPUTIME_ID) - start);
}

// ---- Windows ----

Window random_window(int frames, size_t pixels) {
  Window window(frames, pixels);
  std::mt19937_64 rng(7);
  for (int t = 0; t < frames; ++t) {
    const int slot = window.append();
    for (int c = 0; c < kChannels; ++c)
      for (size_t p = 0; p < pixels; p += 8) {
        const uint64_t samples = rng();
        std::memcpy(window.plane(slot, c) + p, &samples, std::min<size_t>(8, pixels - p));
      }
  }
  return window;
}

struct Case {
  int frames, width, height, threads;
  int slices = 1;  // calls for each group of frames, as live mode spreads them
};

// A whole window as the engine adds it: 3m (3m + 1) / 2 products a pixel are asked for. Medians,
// with the peak measured in turn, because others may use the machine; for the same reason the time
// of one thread is what it computed, not what it waited for a core. Several threads take real time.
void window_gram(benchmark::State& state, const Kernel& kernel, const Case& c) {
  const auto pixels = static_cast<size_t>(c.width) * static_cast<size_t>(c.height);
  const Window window = random_window(c.frames, pixels);
  const double gigaproducts = 1.5 * c.frames * (3.0 * c.frames + 1) * double(pixels) / 1e9;
  Pool pool(c.threads);
  SlidingGram gram(c.frames, &pool, kernel);
  const Peak* peak = peak_of(kernel);
  const clockid_t clock = c.threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC;
  const size_t slice = (window.plane_size() + size_t(c.slices) - 1) / size_t(c.slices);
  std::vector<double> rates, fractions;
  for (auto _ : state) {
    const double most = peak ? peak_gmacs(*peak) * c.threads : 0;
    const double start = seconds(clock);
    for (int first = 0; first < c.frames; first += kGroup) {
      const int end = std::min(first + kGroup, c.frames);
      for (size_t p = 0; p < window.plane_size(); p += slice)
        gram.add_slice({window, 0, end}, end - first, p, std::min(slice, window.plane_size() - p));
    }
    const double took = seconds(clock) - start;
    state.SetIterationTime(took);
    rates.push_back(gigaproducts / took);
    if (peak) fractions.push_back(rates.back() / most);
  }
  state.counters["GMAC/s"] = median(rates);
  if (peak) state.counters["of_peak"] = median(fractions);
}

// The window with a quarter of the chroma samples, 2 x 2 pixels to each.
void window_of_shared_chroma(benchmark::State& state, const Kernel& kernel, const Case& c) {
  const ChromaShape shape = {c.width, c.height, 2, 2};
  Window window(c.frames, shape);
  std::mt19937 rng(7);
  for (int t = 0; t < c.frames; ++t) {
    const int slot = window.append();
    for (int channel = 0; channel < kChannels; ++channel)
      for (size_t p = 0; p < (channel == 0 ? shape.pixels() : shape.samples()); ++p)
        window.plane(slot, channel)[p] = static_cast<uint8_t>(rng() >> 9);
  }
  Pool pool(c.threads);
  SlidingGram gram(c.frames, shape, 8, &pool, kernel);
  const clockid_t clock = c.threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC;
  const int slice = (shape.chroma_height() + c.slices - 1) / c.slices;
  for (auto _ : state) {
    const double start = seconds(clock);
    for (int first = 0; first < c.frames; first += kGroup) {
      const int end = std::min(first + kGroup, c.frames);
      for (int row = 0; row < shape.chroma_height(); row += slice)
        gram.add_rows({window, 0, end}, end - first, row,
                      std::min(slice, shape.chroma_height() - row));
    }
    state.SetIterationTime(seconds(clock) - start);
  }
}

void register_window(const Kernel& kernel, const Case& c) {
  std::string name = std::string(kernel.name) + "/m:" + std::to_string(c.frames) + "/" +
                     std::to_string(c.width) + "x" + std::to_string(c.height) +
                     "/threads:" + std::to_string(c.threads);
  if (c.slices > 1) name += "/slices:" + std::to_string(c.slices);
  benchmark::RegisterBenchmark(
      name.c_str(), [kernel, c](benchmark::State& state) { window_gram(state, kernel, c); })
      ->Unit(benchmark::kMillisecond)
      ->UseManualTime();
  benchmark::RegisterBenchmark(
      ("shared-chroma/" + name).c_str(),
      [kernel, c](benchmark::State& state) { window_of_shared_chroma(state, kernel, c); })
      ->Unit(benchmark::kMillisecond)
      ->UseManualTime();
}

}  // namespace

int main(int argc, char** argv) {
  for (const Kernel& kernel : kernels()) {
    if (const Peak* peak = peak_of(kernel))
      benchmark::RegisterBenchmark((std::string("peak/") + kernel.name).c_str(),
                                   [peak](benchmark::State& state) {
                                     std::vector<double> rates;
                                     for (auto _ : state) rates.push_back(peak_gmacs(*peak));
                                     state.counters["GMAC/s"] = median(rates);
                                   });
    register_window(kernel, {25, 320, 240, 1});
    // The plain loop takes seconds for more.
    if (std::string(kernel.name) == "reference") continue;
    for (int threads : {1, 2}) {
      for (int frames : {100, 200}) {
        register_window(kernel, {frames, 320, 240, threads});
        register_window(kernel, {frames, 768, 576, threads});
      }
      register_window(kernel, {60, 1920, 1080, threads});
    }
    register_window(kernel, {100, 320, 240, 1, kGroup});
    register_window(kernel, {100, 1920, 1080, 1, kGroup});
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
