// SPDX-License-Identifier: LGPL-2.1-or-later
// What memory costs when it is touched for the first time: in pages of 4 KiB, and as windows take
// it.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstring>
#include <memory>

#include "core/base/large_vector.h"

namespace {

constexpr int64_t kMegabyte = int64_t{1} << 20;

// Touches memory as frames come one after another: a megabyte at a time.
template <typename Allocator>
void touch(benchmark::State& state) {
  const int64_t megabytes = state.range(0);
  Allocator allocator;
  for (auto _ : state) {
    const auto bytes = static_cast<size_t>(megabytes * kMegabyte);
    uint8_t* const memory = allocator.allocate(bytes);
    for (int64_t i = 0; i < megabytes; ++i) std::memset(memory + i * kMegabyte, 1, kMegabyte);
    benchmark::ClobberMemory();
    // The next round takes it anew.
    allocator.deallocate(memory, bytes);
  }
}

void in_small_pages(benchmark::State& state) { touch<std::allocator<uint8_t>>(state); }
void in_large_pages(benchmark::State& state) { touch<qdmd::LargeAllocator<uint8_t>>(state); }

// The default's window of 1920x1080 in RGB; and little, but more than the C library keeps for those
// who ask next.
BENCHMARK(in_small_pages)->ArgName("MiB")->Arg(64)->Arg(594)->Unit(benchmark::kMillisecond);
BENCHMARK(in_large_pages)->ArgName("MiB")->Arg(64)->Arg(594)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
