#include "core/passes/fill.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/passes/unit_light.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/fill.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Vectors of at most 64 samples: runs are multiples of that.
using Bytes = hn::CappedTag<uint8_t, 64>;

// keep[i] = 0 where bit i is set, else 255; masked[i] counts the former. `count`: a multiple of 64.
void expand_bits(const uint8_t* bits, size_t count, uint8_t* HWY_RESTRICT keep,
                 uint16_t* HWY_RESTRICT masked) {
  const Bytes d;
  const auto ones = hn::Set(d, 255);
  if (hn::Lanes(d) < 8) {
    for (size_t i = 0; i < count; ++i) keep[i] = (bits[i / 8] >> i % 8 & 1) != 0 ? 0 : 255;
  } else {
    for (size_t i = 0; i < count; i += hn::Lanes(d))
      hn::StoreU(hn::IfThenZeroElse(hn::LoadMaskBits(d, bits + i / 8), ones), d, keep + i);
  }
  for (size_t i = 0; i < count; ++i) masked[i] = static_cast<uint16_t>(masked[i] + (keep[i] == 0));
}

// `from` in unit light where kept, else 0.
void take_row(const uint8_t* HWY_RESTRICT from, const uint8_t* HWY_RESTRICT keep, size_t count,
              float factor, uint8_t* HWY_RESTRICT out) {
  if (factor == 1) {
    for (size_t i = 0; i < count; ++i) out[i] = from[i] & keep[i];
    return;
  }
  for (size_t i = 0; i < count; ++i) out[i] = in_light(from[i], factor) & keep[i];
}

// How many of `planes` rows of samples, `stride` apart, are below `limit`, by lanes. Samples are
// counted in bytes, as far as these can count.
template <bool kEqual, class V>
HWY_INLINE void count_below(const uint8_t* samples, size_t stride, size_t planes, V limit,
                            uint16_t* below) {
  const Bytes d;
  std::memset(below, 0, hn::Lanes(d) * sizeof(*below));
  HWY_ALIGN uint8_t part[64];
  for (size_t t = 0; t < planes;) {
    const size_t end = std::min(planes, t + 255);
    auto count = hn::Zero(d);
    for (; t < end; ++t) {
      const auto x = hn::LoadU(d, samples + t * stride);
      const auto is_below = kEqual ? hn::Not(hn::Gt(x, limit)) : hn::Lt(x, limit);
      count = hn::Sub(count, hn::VecFromMask(d, is_below));
    }
    hn::Store(count, d, part);
    for (size_t i = 0; i < hn::Lanes(d); ++i) below[i] = static_cast<uint16_t>(below[i] + part[i]);
  }
}

// The median of each pixel's samples that are not masked, the mean of the middle two rounded down
// where their number is even. samples: `planes` rows, `stride` apart, 0 where masked. level: what
// it is where all are masked. count: a multiple of 64. The median's bits are found from the highest
// down: a bit is set where no more samples lie below than half.
void median_row(const uint8_t* samples, size_t stride, size_t planes,
                const uint16_t* HWY_RESTRICT masked, size_t count, uint8_t* HWY_RESTRICT level) {
  const Bytes d;
  const size_t lanes = hn::Lanes(d);
  HWY_ALIGN uint8_t median[64], candidate[64], upper[64];
  HWY_ALIGN uint16_t below[64], rank[64];
  const auto all = static_cast<uint16_t>(planes);
  for (size_t first = 0; first < count; first += lanes) {
    const uint8_t* x = samples + first;
    const uint16_t* zeros = masked + first;
    for (size_t i = 0; i < lanes; ++i) {
      median[i] = 0;
      rank[i] = static_cast<uint16_t>(zeros[i] + std::max(all - zeros[i] - 1, 0) / 2);
    }
    for (int bit = 128; bit > 0; bit /= 2) {
      for (size_t i = 0; i < lanes; ++i) candidate[i] = static_cast<uint8_t>(median[i] | bit);
      count_below<false>(x, stride, planes, hn::Load(d, candidate), below);
      for (size_t i = 0; i < lanes; ++i) median[i] = below[i] <= rank[i] ? candidate[i] : median[i];
    }
    // The upper of the middle two is the same, or the least sample above.
    const auto lower = hn::Load(d, median);
    count_below<true>(x, stride, planes, lower, below);
    auto least = hn::Set(d, 255);
    for (size_t t = 0; t < planes; ++t) {
      const auto sample = hn::LoadU(d, x + t * stride);
      least = hn::IfThenElse(hn::Gt(sample, lower), hn::Min(least, sample), least);
    }
    hn::Store(least, d, upper);
    for (size_t i = 0; i < lanes; ++i) {
      if (zeros[i] == all) continue;
      const int number = all - zeros[i];
      const bool next = number % 2 == 0 && below[i] == zeros[i] + number / 2;
      level[first + i] = static_cast<uint8_t>((median[i] + (next ? upper[i] : median[i])) / 2);
    }
  }
}

// Samples that are not kept become the level; others come as near to it as reach. count: a multiple
// of 64.
void draw_row(const uint8_t* HWY_RESTRICT level, const uint8_t* HWY_RESTRICT reach,
              const uint8_t* HWY_RESTRICT keep, size_t count, uint8_t* HWY_RESTRICT samples) {
  const Bytes d;
  for (size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto x = hn::LoadU(d, samples + i), l = hn::LoadU(d, level + i);
    const auto above = hn::SaturatedSub(x, l), below = hn::SaturatedSub(l, x);
    const auto limit = hn::And(hn::LoadU(d, reach + i), hn::LoadU(d, keep + i));
    const auto up = hn::Min(above, limit), down = hn::Min(below, limit);
    // One of them is 0.
    hn::StoreU(hn::Sub(hn::Add(l, up), down), d, samples + i);
  }
}

// Samples that are not kept become the level.
void fill_row(const uint8_t* HWY_RESTRICT level, const uint8_t* HWY_RESTRICT keep, size_t count,
              uint8_t* HWY_RESTRICT samples) {
  for (size_t i = 0; i < count; ++i)
    samples[i] = static_cast<uint8_t>(samples[i] | (level[i] & static_cast<uint8_t>(~keep[i])));
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(expand_bits);
HWY_EXPORT(take_row);
HWY_EXPORT(median_row);
HWY_EXPORT(draw_row);
HWY_EXPORT(fill_row);

constexpr size_t kUnit = 64;
// Of samples and what is kept of them.
constexpr size_t kRunBytes = size_t{1} << 19;

size_t round_up(size_t count) { return (count + kUnit - 1) / kUnit * kUnit; }

// Pixels of a run.
size_t run_of(int snapshots) {
  const auto m = static_cast<size_t>(std::max(snapshots, 1));
  return std::clamp(kRunBytes / (m * (kChannels + 1)) / kUnit * kUnit, kUnit, size_t{4096});
}

}  // namespace

WindowMask::WindowMask(int capacity, size_t pixels)
    // Vectors of bits are read whole, also at the end.
    : stride_(mask_bytes(pixels)), bits_(stride_ * static_cast<size_t>(capacity) + kUnit) {}

uint64_t WindowMask::bytes(int capacity, size_t pixels) {
  return uint64_t{mask_bytes(pixels)} * static_cast<uint64_t>(capacity) + kUnit;
}

uint64_t Filler::bytes(int snapshots) {
  const auto m = static_cast<uint64_t>(std::max(snapshots, 1));
  const uint64_t run = run_of(snapshots);
  return (m + m * kChannels + 1 + sizeof(uint16_t)) * run + m * kChannels * sizeof(uint8_t*);
}

Filler::Filler(int snapshots) : run_(run_of(snapshots)) {
  const auto m = static_cast<size_t>(std::max(snapshots, 1));
  keep_.resize(m * run_);
  // One row more for the level.
  samples_.resize((m * kChannels + 1) * run_);
  masked_.resize(run_);
  planes_.reserve(m * kChannels);
  for (size_t k = 0; k < m * kChannels; ++k) planes_.push_back(samples_.data() + k * run_);
}

const uint8_t* const* Filler::fill(const SnapshotRange& snapshots, const std::vector<Gain>& gains,
                                   const WindowMask& mask, const Reference& reference,
                                   const uint8_t* reach, size_t first, size_t count) {
  const auto m = static_cast<size_t>(snapshots.size());
  const size_t padded = round_up(count);
  std::fill_n(masked_.data(), padded, uint16_t{0});
  for (size_t t = 0; t < m; ++t) {
    uint8_t* keep = keep_.data() + t * run_;
    const int snapshot = static_cast<int>(t);
    HWY_DYNAMIC_DISPATCH(expand_bits)(mask.of(snapshot) + first / 8, padded, keep, masked_.data());
    for (size_t c = 0; c < kChannels; ++c) {
      const float gain = gains[t][c];
      // Planes are padded like runs.
      HWY_DYNAMIC_DISPATCH(take_row)
      (snapshots.plane(snapshot, static_cast<int>(c)) + first, keep, padded,
       gain == 1 ? 1 : 1 / gain, samples_.data() + (kChannels * t + c) * run_);
    }
  }
  uint8_t* level = samples_.data() + m * kChannels * run_;
  for (size_t c = 0; c < kChannels; ++c) {
    std::memcpy(level, reference.level[c].data() + first, count);
    std::memset(level + count, 0, padded - count);
    HWY_DYNAMIC_DISPATCH(median_row)
    (samples_.data() + c * run_, kChannels * run_, m, masked_.data(), padded, level);
    for (size_t t = 0; t < m; ++t) {
      const uint8_t* keep = keep_.data() + t * run_;
      uint8_t* samples = samples_.data() + (kChannels * t + c) * run_;
      if (reach)
        HWY_DYNAMIC_DISPATCH(draw_row)(level, reach + first, keep, padded, samples);
      else
        HWY_DYNAMIC_DISPATCH(fill_row)(level, keep, padded, samples);
    }
  }
  return planes_.data();
}

void fill_samples(const Reference& reference, const uint8_t* bits, const uint8_t* const x[3],
                  const Gain& gain, const uint8_t* reach, int step, uint8_t* const out[3]) {
  size_t sample = 0;
  for (int row = 0; row < reference.height; row += step)
    for (int col = 0; col < reference.width; col += step, ++sample) {
      const auto p = static_cast<size_t>(row) * static_cast<size_t>(reference.width) +
                     static_cast<size_t>(col);
      for (size_t c = 0; c < 3; ++c) {
        const int level = reference.level[c][p], limit = is_masked(bits, p) ? 0 : reach[p];
        const int unit = out_of_light(x[c][p], gain[c]);
        out[c][sample] = static_cast<uint8_t>(std::clamp(unit, level - limit, level + limit));
      }
    }
}

}  // namespace qdmd
#endif
