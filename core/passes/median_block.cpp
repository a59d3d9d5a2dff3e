#include "core/passes/median_block.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/channels.h"
#include "core/passes/unit_light.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/median_block.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

// Pixels that are sorted side by side.
constexpr size_t kRun = kMedianBlock;
// kMedianFrames and one that is never taken: a power of two.
constexpr size_t kMost = 32;

// Sorts `count` samples, a power of two, of each of kRun pixels: Batcher's odd-even merge sort,
// whose comparisons do not depend on the samples. Plain loops, which the compiler makes vectors of.
void sort_samples(uint8_t (*samples)[kRun], size_t count) {
  for (size_t p = 1; p < count; p *= 2)
    for (size_t k = p; k >= 1; k /= 2)
      for (size_t j = k % p; j + k < count; j += 2 * k)
        for (size_t i = 0; i < std::min(k, count - j - k); ++i) {
          if ((i + j) / (2 * p) != (i + j + k) / (2 * p)) continue;
          uint8_t* HWY_RESTRICT low = samples[i + j];
          uint8_t* HWY_RESTRICT high = samples[i + j + k];
          for (size_t x = 0; x < kRun; ++x) {
            const uint8_t a = low[x], b = high[x];
            low[x] = a < b ? a : b;
            high[x] = a < b ? b : a;
          }
        }
}

// The median of count <= kMost samples of each pixel; the mean of the middle two, rounded up, where
// count is even. Sorts them.
void take_median(uint8_t (*samples)[kRun], size_t count, uint8_t* median) {
  size_t room = 1;
  while (room < count) room *= 2;
  for (size_t i = count; i < room; ++i) std::memset(samples[i], 255, kRun);
  sort_samples(samples, room);
  const uint8_t* low = samples[(count - 1) / 2];
  const uint8_t* high = samples[count / 2];
  for (size_t x = 0; x < kRun; ++x) median[x] = static_cast<uint8_t>((low[x] + high[x] + 1) / 2);
}

}  // namespace

void block(const uint8_t* const* rows, const float* inverse, size_t count, size_t width,
           size_t height, size_t stride, uint8_t* const* background, uint8_t* spread) {
  alignas(64) uint8_t samples[kChannels][kMost][kRun], sorted[kMost][kRun], median[kChannels][kRun];
  const auto scatter = [&](const uint8_t* from, uint8_t* to) {
    for (size_t y = 0; y < height; ++y) std::memcpy(to + y * stride, from + y * width, width);
  };
  const size_t used = width * height;
  for (size_t c = 0; c < kChannels; ++c) {
    for (size_t i = 0; i < count; ++i) {
      const uint8_t* from = rows[kChannels * i + c];
      uint8_t* to = samples[c][i];
      for (size_t y = 0; y < height; ++y) std::memcpy(to + y * width, from + y * stride, width);
      std::memset(to + used, 0, kRun - used);
      const float factor = inverse[kChannels * i + c];
      if (factor == 1) continue;
      for (size_t x = 0; x < kRun; ++x) to[x] = in_light(to[x], factor);
    }
    std::memcpy(sorted, samples[c], count * kRun);
    take_median(sorted, count, median[c]);
    scatter(median[c], background[c]);
  }
  for (size_t i = 0; i < count; ++i)
    for (size_t x = 0; x < kRun; ++x) {
      const int r = samples[0][i][x] - median[0][x], g = samples[1][i][x] - median[1][x],
                b = samples[2][i][x] - median[2][x];
      const float norm = std::sqrt(static_cast<float>(r * r + g * g + b * b));
      sorted[i][x] = static_cast<uint8_t>(static_cast<int>(norm < 63.75f ? 4 * norm : 255.0f));
    }
  // One frame says nothing of a spread.
  if (count > 1)
    take_median(sorted, count, median[0]);
  else
    std::memset(median[0], 0, kRun);
  scatter(median[0], spread);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(block);

}  // namespace

void median_block(const uint8_t* const* rows, const float* inverse, size_t count, size_t width,
                  size_t height, size_t stride, uint8_t* const* background, uint8_t* spread) {
  HWY_DYNAMIC_DISPATCH(block)(rows, inverse, count, width, height, stride, background, spread);
}

}  // namespace qdmd
#endif
