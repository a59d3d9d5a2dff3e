#include "core/passes/median_block.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/base/channels.h"
#include "core/passes/median_network.h"
#include "core/passes/residual.h"
#include "core/passes/unit_light.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/median_block.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr size_t kRun = kMedianBlock;
// Whole vectors of every instruction set.
constexpr size_t kUnit = 64;

// The medians of rows of `count` samples, a multiple of kUnit; the mean of the middle two, rounded
// up, where there are two. Leaves the samples in another order.
void take_median(const MedianNetwork<16>& network, size_t count, uint8_t (*samples)[kRun],
                 uint8_t* median) {
  const hn::CappedTag<uint8_t, kUnit> d;
  for (size_t i = 0; i < count; i += hn::Lanes(d)) {
    for (const auto& [smaller, larger] : network) {
      uint8_t *low = samples[smaller] + i, *high = samples[larger] + i;
      const auto a = hn::Load(d, low), b = hn::Load(d, high);
      hn::Store(hn::Min(a, b), d, low);
      hn::Store(hn::Max(a, b), d, high);
    }
    hn::Store(hn::AverageRound(hn::Load(d, samples[network.lower_middle()] + i),
                               hn::Load(d, samples[network.upper_middle()] + i)),
              d, median + i);
  }
}

// A plain loop, which the compiler makes vectors of.
void scale_row(size_t count, float factor, uint8_t* samples) {
  for (size_t i = 0; i < count; ++i) samples[i] = in_light(samples[i], factor);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(take_median);
HWY_EXPORT(scale_row);

constexpr size_t kRun = kMedianBlock, kUnit = 64, kMost = 16;
static_assert(kMedianFrames <= kMost);
using Network = MedianNetwork<kMost>;

template <size_t... kCounts>
constexpr std::array<Network, sizeof...(kCounts)> networks_of(std::index_sequence<kCounts...>) {
  return {Network(kCounts)...};
}
// Of 0 .. kMedianFrames samples.
constexpr auto kNetworks = networks_of(std::make_index_sequence<kMedianFrames + 1>());

// Of a few samples: a call of memcpy would take longer.
void copy_row(const uint8_t* from, size_t count, uint8_t* to) {
  // Two halves that may overlap.
  const auto copy = [&](auto size) {
    std::memcpy(to, from, size);
    std::memcpy(to + count - size, from + count - size, size);
  };
  using std::integral_constant;
  if (count > 32)
    std::memcpy(to, from, count);
  else if (count >= 16)
    copy(integral_constant<size_t, 16>());
  else if (count >= 8)
    copy(integral_constant<size_t, 8>());
  else if (count >= 4)
    copy(integral_constant<size_t, 4>());
  else
    for (size_t i = 0; i < count; ++i) to[i] = from[i];
}

}  // namespace

void median_block(const uint8_t* const* rows, const size_t* strides, const float* inverse,
                  size_t count, size_t width, size_t height, size_t stride,
                  uint8_t* const* background, uint8_t* spread) {
  alignas(64) uint8_t samples[kChannels][kMost][kRun], sorted[kMost][kRun], median[kChannels][kRun];
  const size_t used = width * height, padded = (used + kUnit - 1) / kUnit * kUnit;
  const auto scatter = [&](const uint8_t* from, uint8_t* to) {
    for (size_t y = 0; y < height; ++y) copy_row(from + y * width, width, to + y * stride);
  };
  const Network& network = kNetworks[count];
  for (size_t c = 0; c < kChannels; ++c) {
    for (size_t i = 0; i < count; ++i) {
      const uint8_t* from = rows[kChannels * i + c];
      const size_t step = strides[kChannels * i + c];
      uint8_t* to = samples[c][i];
      for (size_t y = 0; y < height; ++y) {
        // Cells that follow take mostly the same frames' next samples, too far apart for the
        // hardware to foresee.
        hwy::Prefetch(from + y * step + kUnit);
        copy_row(from + y * step, width, to + y * width);
      }
      std::memset(to + used, 0, padded - used);
      const float factor = inverse[kChannels * i + c];
      if (factor != 1) HWY_DYNAMIC_DISPATCH(scale_row)(padded, factor, to);
      for (size_t x = 0; x < padded; x += kUnit) std::memcpy(sorted[i] + x, to + x, kUnit);
    }
    HWY_DYNAMIC_DISPATCH(take_median)(network, padded, sorted, median[c]);
    scatter(median[c], background[c]);
  }
  const uint8_t* const middle[3] = {median[0], median[1], median[2]};
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* const x[3] = {samples[0][i], samples[1][i], samples[2][i]};
    residual_norm(x, middle, padded, sorted[i], 4);
  }
  // One frame says nothing of a spread: its distance is 0.
  HWY_DYNAMIC_DISPATCH(take_median)(network, padded, sorted, median[0]);
  scatter(median[0], spread);
}

}  // namespace qdmd
#endif
