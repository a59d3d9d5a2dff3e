// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/fill.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/passes/read_samples.h"
#include "core/passes/unit_light.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/fill.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Vectors of at most 64 samples: runs are multiples of that.
template <typename T>
using Samples = hn::CappedTag<T, 64>;

// keep[i] = 0 where bit i is set, else 255; masked[i] counts the former. `count`: a multiple of 64.
void expand_bits(const uint8_t* bits, size_t count, uint8_t* HWY_RESTRICT keep,
                 uint16_t* HWY_RESTRICT masked) {
  const Samples<uint8_t> d;
  const auto ones = hn::Set(d, 255);
  if (hn::Lanes(d) < 8) {
    for (size_t i = 0; i < count; ++i) keep[i] = (bits[i / 8] >> i % 8 & 1) != 0 ? 0 : 255;
  } else {
    for (size_t i = 0; i < count; i += hn::Lanes(d))
      hn::StoreU(hn::IfThenZeroElse(hn::LoadMaskBits(d, bits + i / 8), ones), d, keep + i);
  }
  for (size_t i = 0; i < count; ++i) masked[i] = static_cast<uint16_t>(masked[i] + (keep[i] == 0));
}

// `from` in unit light where kept, else 0. next: what the next call reads; planes are too many
// streams for the hardware to foresee.
void take_row(const uint8_t* HWY_RESTRICT from, const uint8_t* HWY_RESTRICT keep, size_t count,
              const LevelMap& map, const uint8_t* next, uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; i += 64) hwy::Prefetch(next + i);
  if (!map.changes()) {
    for (size_t i = 0; i < count; ++i) out[i] = from[i] & keep[i];
    return;
  }
  for (size_t i = 0; i < count; ++i) out[i] = in_light(from[i], map) & keep[i];
}

// take_row() for whole samples, whose digits are high and low. next_high, next_low: as above.
void take_deep_row(const uint8_t* HWY_RESTRICT high, const uint8_t* HWY_RESTRICT low,
                   const uint8_t* HWY_RESTRICT keep, int low_bits, size_t count,
                   const LevelMap& map, const uint8_t* next_high, const uint8_t* next_low,
                   uint16_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; i += 64) {
    hwy::Prefetch(next_high + i);
    hwy::Prefetch(next_low + i);
  }
  if (!map.changes()) {
    for (size_t i = 0; i < count; ++i)
      out[i] = static_cast<uint16_t>((high[i] << low_bits | low[i]) & keep[i] * 257);
    return;
  }
  const auto unit = static_cast<float>(1 << low_bits);
  const float bias = 0.5f + map.offset * unit, least = map.least * unit,
              most = (map.most + 1) * unit - 1;
  for (size_t i = 0; i < count; ++i) {
    const float level = static_cast<float>(high[i] << low_bits | low[i]) * map.factor + bias;
    const float below = level < most ? level : most;
    out[i] = static_cast<uint16_t>(static_cast<int>(below > least ? below : least) & keep[i] * 257);
  }
}

// The samples of all planes at as many pixels as a vector has, `stride` apart.
template <typename T>
struct Column {
  const T* samples;
  size_t stride, planes;

  hn::Vec<Samples<T>> at(size_t t) const { return hn::LoadU(Samples<T>(), samples + t * stride); }
};

// Counts of samples, as far as bytes can count: part(t, first, second) adds to them 1 or 0 for
// plane t. total: of as many as are wanted, 1 or 2.
template <size_t kCounts, typename T, class Part>
HWY_INLINE void count_samples(size_t planes, uint16_t (*total)[64], Part part) {
  const Samples<T> d;
  std::memset(total, 0, kCounts * sizeof(*total));
  for (size_t t = 0; t < planes;) {
    const size_t end = std::min(planes, t + 255);
    auto first = hn::Zero(d), second = hn::Zero(d);
    for (; t < end; ++t) part(t, first, second);
    HWY_ALIGN T counted[64];
    hn::Store(first, d, counted);
    for (size_t i = 0; i < hn::Lanes(d); ++i)
      total[0][i] = static_cast<uint16_t>(total[0][i] + counted[i]);
    if (kCounts == 1) continue;
    hn::Store(second, d, counted);
    for (size_t i = 0; i < hn::Lanes(d); ++i)
      total[kCounts - 1][i] = static_cast<uint16_t>(total[kCounts - 1][i] + counted[i]);
  }
}

// 1 where x < limit, else 0. Masks of comparisons would take longer to become numbers.
template <class V>
HWY_INLINE V is_below(V x, V limit) {
  return hn::Min(hn::SaturatedSub(limit, x), hn::Set(hn::DFromV<V>(), hn::TFromV<V>{1}));
}

// The median of each pixel's samples that are not masked, the mean of the middle two rounded down
// where their number is even; 0 where masked. level: near what it is; stays where all are masked.
// masked: how many are. unit: samples of a level. The median's bits are found from the highest
// down: a bit is set where no more samples lie below than half. Where the median of no pixel is far
// from `level`, that begins near it.
template <typename T>
HWY_INLINE void take_median(const Column<T>& column, const uint16_t* HWY_RESTRICT masked, int unit,
                            T* HWY_RESTRICT level) {
  const int near = 8 * unit;
  const Samples<T> d;
  const size_t lanes = hn::Lanes(d);
  HWY_ALIGN T median[64], candidate[64], upper[64];
  HWY_ALIGN uint16_t below[2][64], rank[64];
  const auto all = static_cast<uint16_t>(column.planes);
  for (size_t i = 0; i < lanes; ++i) {
    median[i] = static_cast<T>(std::clamp(level[i] - near / 2, 0, 256 * unit - near));
    rank[i] = static_cast<uint16_t>(masked[i] + std::max(all - masked[i] - 1, 0) / 2);
  }
  const auto low = hn::Load(d, median), high = hn::Add(low, hn::Set(d, static_cast<T>(near - 1)));
  count_samples<2, T>(column.planes, below, [&](size_t t, auto& under, auto& over) HWY_ATTR {
    const auto x = column.at(t);
    under = hn::Add(under, is_below(x, low));
    over = hn::Add(over, is_below(high, x));
  });
  int far = 0;
  for (size_t i = 0; i < lanes; ++i)
    far |= static_cast<int>(masked[i] != all) & (static_cast<int>(below[0][i] > rank[i]) |
                                                 static_cast<int>(all - below[1][i] <= rank[i]));
  if (far) std::memset(median, 0, sizeof(median));
  for (int bit = far ? 128 * unit : near / 2; bit > 0; bit /= 2) {
    for (size_t i = 0; i < lanes; ++i) candidate[i] = static_cast<T>(median[i] + bit);
    const auto limit = hn::Load(d, candidate);
    count_samples<1, T>(column.planes, below, [&](size_t t, auto& under, auto&) HWY_ATTR {
      under = hn::Add(under, is_below(column.at(t), limit));
    });
    for (size_t i = 0; i < lanes; ++i)
      median[i] = below[0][i] <= rank[i] ? candidate[i] : median[i];
  }
  // The upper of the middle two is the same, or the least sample above: that is so much above,
  // less 1, so that those that are not above count for more than any.
  const auto lower = hn::Load(d, median), one = hn::Set(d, T{1});
  auto least = hn::Set(d, static_cast<T>(~T{0}));
  count_samples<1, T>(column.planes, below, [&](size_t t, auto& over, auto&) HWY_ATTR {
    const auto above = hn::SaturatedSub(column.at(t), lower);
    over = hn::Add(over, hn::Min(above, one));
    least = hn::Min(least, hn::Sub(above, one));
  });
  hn::Store(hn::Add(hn::Add(lower, least), one), d, upper);
  for (size_t i = 0; i < lanes; ++i) {
    if (masked[i] == all) continue;
    const int number = all - masked[i];
    const bool next = number % 2 == 0 && all - below[0][i] == masked[i] + number / 2;
    level[i] = static_cast<T>((median[i] + (next ? upper[i] : median[i])) / 2);
  }
}

// What lies beside samples, for as many of them: 255 or 0 as all bits or none.
template <class D>
HWY_INLINE hn::Vec<D> whole(D d, const uint8_t* from) {
  if constexpr (sizeof(hn::TFromD<D>) == 1) {
    return hn::LoadU(d, from);
  } else {
    const hn::RebindToSigned<D> wide;
    const hn::Rebind<int8_t, D> narrow;
    return hn::BitCast(
        d, hn::PromoteTo(wide, hn::LoadU(narrow, reinterpret_cast<const int8_t*>(from))));
  }
}
// Levels, of 2^low_bits samples each.
template <class D>
HWY_INLINE hn::Vec<D> in_samples(D d, const uint8_t* from, int low_bits) {
  if constexpr (sizeof(hn::TFromD<D>) == 1) {
    return hn::LoadU(d, from);
  } else {
    const hn::Rebind<uint8_t, D> narrow;
    return hn::ShiftLeftSame(hn::PromoteTo(d, hn::LoadU(narrow, from)), low_bits);
  }
}

// Samples, `planes` rows of them `stride` apart and 0 where not kept, of `count` pixels, a multiple
// of 64: what is not kept becomes the median of the others, or stays at `level` where there are
// none; others come as near to it as reach, or stay where there is no reach. keep: rows
// `keep_stride` apart. level: near the medians, which it becomes.
template <typename T>
HWY_INLINE void fill(T* samples, size_t stride, size_t planes, const uint8_t* keep,
                     size_t keep_stride, const uint16_t* masked, const uint8_t* reach, int low_bits,
                     size_t count, T* level) {
  const Samples<T> d;
  for (size_t first = 0; first < count; first += hn::Lanes(d)) {
    take_median<T>({samples + first, stride, planes}, masked + first, 1 << low_bits, level + first);
    // While the samples are in the first cache.
    const auto l = hn::LoadU(d, level + first);
    const auto most =
        reach ? in_samples(d, reach + first, low_bits) : hn::Set(d, static_cast<T>(~T{0}));
    for (size_t t = 0; t < planes; ++t) {
      T* at = samples + t * stride + first;
      const auto x = hn::LoadU(d, at);
      const auto limit = hn::And(most, whole(d, keep + t * keep_stride + first));
      const auto up = hn::Min(hn::SaturatedSub(x, l), limit);
      const auto down = hn::Min(hn::SaturatedSub(l, x), limit);
      // One of them is 0.
      hn::StoreU(hn::Sub(hn::Add(l, up), down), d, at);
    }
  }
}

void fill_rows(uint8_t* samples, size_t stride, size_t planes, const uint8_t* keep,
               size_t keep_stride, const uint16_t* masked, const uint8_t* reach, size_t count,
               uint8_t* level) {
  fill(samples, stride, planes, keep, keep_stride, masked, reach, 0, count, level);
}
void fill_deep_rows(uint16_t* samples, size_t stride, size_t planes, const uint8_t* keep,
                    size_t keep_stride, const uint16_t* masked, const uint8_t* reach, int low_bits,
                    size_t count, uint16_t* level) {
  fill(samples, stride, planes, keep, keep_stride, masked, reach, low_bits, count, level);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(expand_bits);
HWY_EXPORT(take_row);
HWY_EXPORT(take_deep_row);
HWY_EXPORT(fill_rows);
HWY_EXPORT(fill_deep_rows);

constexpr size_t kUnit = 64;
// The bytes of a run's samples, and of what is kept of them.
constexpr size_t kRunBytes = size_t{1} << 19;

size_t round_up(size_t count) { return (count + kUnit - 1) / kUnit * kUnit; }

// Pixels of a run.
template <typename Sample>
size_t run_of(int snapshots) {
  const auto m = static_cast<size_t>(std::max(snapshots, 1));
  const size_t of_pixel = m * (kChannels * sizeof(Sample) + 1);
  // An odd number of cache lines: those of all snapshots at a pixel are then in different sets.
  const size_t units = std::clamp<size_t>(kRunBytes / of_pixel / kUnit, 1, 4096 / kUnit);
  return (units - 1) / 2 * 2 * kUnit + kUnit;
}

// Bytes for the bits of a run's mask. Vectors of bits are read whole, also at the end.
size_t bits_size(size_t run) { return run / 8 + kUnit; }

}  // namespace

template <typename Sample>
uint64_t Filler<Sample>::bytes(int snapshots) {
  const auto m = static_cast<uint64_t>(std::max(snapshots, 1));
  const uint64_t run = run_of<Sample>(snapshots), size = sizeof(Sample);
  return (m + size * (m * kChannels + 1) + sizeof(uint16_t) + size) * run + bits_size(run) +
         m * kChannels * sizeof(Sample*);
}

template <typename Sample>
Filler<Sample>::Filler(int snapshots, const SampleRange& range)
    : run_(run_of<Sample>(snapshots)), range_(range) {
  const auto m = static_cast<size_t>(std::max(snapshots, 1)), planes = m * kChannels;
  keep_.resize(m * run_);
  masked_.resize(run_);
  spread_.resize(sizeof(Sample) * run_);
  bits_.resize(bits_size(run_));
  // One row more for the level.
  samples_.resize((planes + 1) * run_);
  planes_.reserve(planes);
  for (size_t k = 0; k < planes; ++k) planes_.push_back(samples_.data() + k * run_);
}

// What is kept of each snapshot, in unit light.
template <typename Sample>
void Filler<Sample>::take_rows(const SnapshotRange& snapshots, const std::vector<Gain>& gains,
                               const WindowMask& mask, size_t first, size_t count) {
  const auto m = static_cast<size_t>(snapshots.size());
  const size_t padded = round_up(count);
  std::fill_n(masked_.data(), padded, uint16_t{0});
  for (size_t t = 0; t < m; ++t) {
    uint8_t* keep = keep_.data() + t * run_;
    const int snapshot = static_cast<int>(t), next = std::min(snapshot + 1, snapshots.size() - 1);
    mask.read(snapshot, first, padded, bits_.data());
    HWY_DYNAMIC_DISPATCH(expand_bits)(bits_.data(), padded, keep, masked_.data());
    for (int c = 0; c < kChannels; ++c) {
      const auto channel = static_cast<size_t>(c);
      const LevelMap map = SampleLight(gains[t], range_).back(channel);
      Sample* const to = samples_.data() + (kChannels * t + channel) * run_;
      // Planes are padded like runs.
      const bool own = c == 0 || !snapshots.shape().is_shared();
      if constexpr (sizeof(Sample) == 1) {
        const uint8_t* const from =
            read_samples(snapshots, snapshot, c, first, count, spread_.data());
        HWY_DYNAMIC_DISPATCH(take_row)
        (from, keep, padded, map, own ? snapshots.plane(next, c) + first : from, to);
      } else {
        const Samples from = read_whole_samples(snapshots, snapshot, c, first, count,
                                                {spread_.data(), spread_.data() + run_});
        const Samples then = own ? snapshots.samples(next, c) + first : from;
        HWY_DYNAMIC_DISPATCH(take_deep_row)
        (from.high, from.low, keep, bits_below(snapshots.depth()), padded, map, then.high, then.low,
         to);
      }
    }
  }
}

template <typename Sample>
const Sample* const* Filler<Sample>::fill(const SnapshotRange& snapshots,
                                          const std::vector<Gain>& gains, const WindowMask& mask,
                                          const ReferencePicture& reference, const uint8_t* reach,
                                          size_t first, size_t count) {
  const auto m = static_cast<size_t>(snapshots.size());
  const size_t padded = round_up(count);
  take_rows(snapshots, gains, mask, first, count);
  Sample* const level = samples_.data() + m * kChannels * run_;
  const uint8_t* const most = reach ? reach + first : nullptr;
  for (size_t c = 0; c < kChannels; ++c) {
    const uint8_t* const known = reference.level[c].data() + first;
    Sample* const rows = samples_.data() + c * run_;
    std::fill(level + count, level + padded, Sample{0});
    if constexpr (sizeof(Sample) == 1) {
      std::copy_n(known, count, level);
      HWY_DYNAMIC_DISPATCH(fill_rows)
      (rows, kChannels * run_, m, keep_.data(), run_, masked_.data(), most, padded, level);
    } else {
      const int shift = bits_below(snapshots.depth());
      // The middle of what has these highest eight bits.
      for (size_t p = 0; p < count; ++p)
        level[p] = static_cast<uint16_t>((2 * known[p] + 1) << shift >> 1);
      HWY_DYNAMIC_DISPATCH(fill_deep_rows)
      (rows, kChannels * run_, m, keep_.data(), run_, masked_.data(), most, shift, padded, level);
    }
  }
  return planes_.data();
}

template class Filler<uint8_t>;
template class Filler<uint16_t>;

void fill_samples(const ReferencePicture& reference, const uint8_t* bits, const KeptPicture& x,
                  const SampleLight& light, const uint8_t* reach, const SampledRows& rows,
                  uint8_t* const out[3]) {
  const bool lit = light.changes();
  SampleFinder samples(x, reference.width);
  size_t sample = 0;
  for (int row = rows.first; row < rows.end; row += rows.step) {
    // The hardware does not foresee rows that are far apart.
    if (row + rows.step < rows.end) {
      samples.seek(row + rows.step);
      for (size_t c = 0; c < kChannels; ++c)
        for (size_t i = 0; i < samples.row_size(c); i += 64) hwy::Prefetch(samples.row(c) + i);
    }
    samples.seek(row);
    for (int col = 0; col < reference.width; col += rows.step, ++sample) {
      const auto p = static_cast<size_t>(row) * static_cast<size_t>(reference.width) +
                     static_cast<size_t>(col);
      const int limit = is_masked(bits, p) ? 0 : reach[p];
      for (size_t c = 0; c < 3; ++c) {
        const int level = reference.level[c][p];
        const uint8_t own = samples.at(c, static_cast<size_t>(col));
        const int unit = lit ? out_of_light(own, light, c) : own;
        out[c][sample] = static_cast<uint8_t>(std::clamp(unit, level - limit, level + limit));
      }
    }
  }
}

}  // namespace qdmd
#endif
