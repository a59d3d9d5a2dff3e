// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/median_block.h"

#include <algorithm>
#include <bit>
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

// Whole vectors of every instruction set.
constexpr size_t kUnit = 64;
// The samples of a block, those of a channel behind those of the one before, to the end of vectors.
constexpr size_t kSamples = 3 * kMedianBlock + kUnit;

// The medians of rows of `count` samples, a multiple of kUnit; the mean of the middle two, rounded
// up, where there are two. Leaves the samples in another order.
void take_median(const MedianNetwork<16>& network, size_t count, uint8_t (*samples)[kSamples],
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
void scale_row(size_t count, const LevelMap& map, uint8_t* samples) {
  // Samples may lie anywhere: for the compiler, even there.
  const LevelMap own = map;
  for (size_t i = 0; i < count; ++i) samples[i] = in_light(samples[i], own);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(take_median);
HWY_EXPORT(scale_row);

using HWY_NAMESPACE::kSamples, HWY_NAMESPACE::kUnit;
constexpr size_t kRun = kMedianBlock, kMost = 16;
static_assert(kMedianFrames <= kMost);
using Network = MedianNetwork<kMost>;

template <size_t... kCounts>
constexpr std::array<Network, sizeof...(kCounts)> networks_of(std::index_sequence<kCounts...>) {
  return {Network(kCounts)...};
}
// The networks for 0 .. kMedianFrames samples.
constexpr auto kNetworks = networks_of(std::make_index_sequence<kMedianFrames + 1>());

// Copies a few samples: a call of memcpy would take longer.
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
  else if (count >= 2)
    copy(integral_constant<size_t, 2>());
  else
    for (size_t i = 0; i < count; ++i) to[i] = from[i];
}

size_t padded(size_t count) { return (count + kUnit - 1) / kUnit * kUnit; }

// Each byte twice, the first one first.
uint64_t doubled(uint32_t bytes) {
  uint64_t apart = bytes;
  apart = (apart | apart << 16) & 0x0000FFFF0000FFFF;
  apart = (apart | apart << 8) & 0x00FF00FF00FF00FF;
  return apart | apart << 8;
}
// The first byte in memory is the lowest.
static_assert(std::endian::native == std::endian::little);

// Samples that two pixels of a row share, `across` in a row, for each pixel of the block. Reads up
// to four bytes behind the samples and writes up to eight behind the pixels.
void spread_block(const MedianBlock& block, size_t across, const uint8_t* samples, uint8_t* to) {
  const size_t skipped = 8 * block.left, step = 8 - 2 * block.left;
  size_t row = block.top;  // of the pixels that share these samples
  for (size_t y = 0; y < block.height; ++y, to += block.width) {
    const uint8_t* from = samples;
    for (size_t x = 0; x < block.width; x += step, from += step / 2) {
      uint32_t few;
      std::memcpy(&few, from, sizeof(few));
      const uint64_t pixels = doubled(few) >> skipped;
      std::memcpy(to + x, &pixels, sizeof(pixels));
    }
    if (++row == block.rows) row = 0, samples += across;
  }
}

// The samples of a block, one channel behind the other.
class BlockLayout {
 public:
  // shared: channels 1 and 2 have the samples that pixels share.
  BlockLayout(const MedianBlock& block, bool shared)
      : block_(block),
        shared_(shared),
        across_(block.shared_width()),
        down_(block.shared_height()) {
    for (size_t c = 0; c < kChannels; ++c)
      begin_[c + 1] = begin_[c] + (is_shared(c) ? across_ * down_ : block.width * block.height);
  }
  size_t begin(size_t channel) const { return begin_[channel]; }
  size_t end(size_t channel) const { return begin_[channel + 1]; }
  size_t all() const { return begin_[kChannels]; }
  bool is_shared(size_t channel) const { return shared_ && channel > 0; }

  // Writes a channel of a frame to its place; what lies behind it is lost.
  void take(const MedianFrame& frame, size_t channel, uint8_t* samples) const {
    uint8_t* const to = samples + begin(channel);
    if (channel == 0 || !frame.is_shared) {
      copy(frame, channel, block_.width, block_.height, to);
    } else if (shared_) {
      copy(frame, channel, across_, down_, to);
    } else {
      uint8_t few[kRun + sizeof(uint32_t)];
      copy(frame, channel, across_, down_, few);
      spread(few, to);
    }
    if (const LevelMap& map = frame.map[channel]; map.changes())
      HWY_DYNAMIC_DISPATCH(scale_row)(end(channel) - begin(channel), map, to);
  }
  // Copies the samples that pixels share.
  void spread(const uint8_t* samples, uint8_t* to) const {
    spread_block(block_, across_, samples, to);
  }

 private:
  static void copy(const MedianFrame& frame, size_t channel, size_t width, size_t height,
                   uint8_t* to) {
    const uint8_t* from = frame.first[channel];
    for (size_t y = 0; y < height; ++y, from += frame.stride[channel], to += width) {
      // Cells that follow take mostly the same frames' next samples, too far apart for the
      // hardware to foresee.
      hwy::Prefetch(from + kUnit);
      copy_row(from, width, to);
    }
  }

  const MedianBlock& block_;
  bool shared_;
  size_t across_, down_;  // of the samples that pixels share
  size_t begin_[kChannels + 1] = {};
};

}  // namespace

void median_block(const MedianBlock& block, const MedianFrame* frames, size_t count, size_t stride,
                  uint8_t* const* background, uint8_t* spread) {
  alignas(64) uint8_t samples[kMost][kSamples], sorted[kMost][kSamples], median[kSamples] = {};
  const BlockLayout layout(block, std::all_of(frames, frames + count, [](const MedianFrame& frame) {
                             return frame.is_shared;
                           }));
  // Norms are of whole vectors, too: of small ones.
  constexpr size_t kFew = 16;
  const size_t pixels = (block.width * block.height + kFew - 1) / kFew * kFew,
               all = padded(layout.all());
  const size_t read = std::max(all, layout.begin(kChannels - 1) + pixels);
  for (size_t i = 0; i < count; ++i) {
    for (size_t c = 0; c < kChannels; ++c) layout.take(frames[i], c, samples[i]);
    std::memset(samples[i] + layout.all(), 0, read - layout.all());
    for (size_t x = 0; x < all; x += kUnit) std::memcpy(sorted[i] + x, samples[i] + x, kUnit);
  }
  const Network& network = kNetworks[count];
  HWY_DYNAMIC_DISPATCH(take_median)(network, all, sorted, median);

  // Samples of pixels: where they share samples, made of these.
  alignas(64) uint8_t room[2][kChannels][kRun + kUnit] = {};
  const auto of_pixels = [&](const uint8_t* from, uint8_t(*made)[kRun + kUnit],
                             const uint8_t** out) {
    for (size_t c = 0; c < kChannels; ++c) {
      out[c] = from + layout.begin(c);
      if (!layout.is_shared(c)) continue;
      layout.spread(out[c], made[c]);
      out[c] = made[c];
    }
  };
  const auto scatter = [&](const uint8_t* from, uint8_t* to) {
    for (size_t y = 0; y < block.height; ++y)
      copy_row(from + y * block.width, block.width, to + y * stride);
  };
  const uint8_t *middle[kChannels], *x[kChannels];
  of_pixels(median, room[0], middle);
  for (size_t c = 0; c < kChannels; ++c) scatter(middle[c], background[c]);
  for (size_t i = 0; i < count; ++i) {
    of_pixels(samples[i], room[1], x);
    residual_norm(x, middle, pixels, sorted[i], 4);
  }
  // One frame says nothing of a spread: its distance is 0.
  HWY_DYNAMIC_DISPATCH(take_median)(network, padded(pixels), sorted, median);
  scatter(median, spread);
}

}  // namespace qdmd
#endif
