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

// `from` in unit light where kept, else 0. next: what the next call reads; planes are too many
// streams for the hardware to foresee.
void take_row(const uint8_t* HWY_RESTRICT from, const uint8_t* HWY_RESTRICT keep, size_t count,
              float factor, const uint8_t* next, uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; i += 64) hwy::Prefetch(next + i);
  if (factor == 1) {
    for (size_t i = 0; i < count; ++i) out[i] = from[i] & keep[i];
    return;
  }
  for (size_t i = 0; i < count; ++i) out[i] = in_light(from[i], factor) & keep[i];
}

// The samples of all planes at as many pixels as a vector has, `stride` apart.
struct Column {
  const uint8_t* samples;
  size_t stride, planes;

  hn::Vec<Bytes> at(size_t t) const { return hn::LoadU(Bytes(), samples + t * stride); }
};

// Counts in bytes, as far as these can count: part(t, first, second) adds to them what plane t has.
// total: of as many as are wanted, 1 or 2.
template <size_t kCounts, class Part>
HWY_INLINE void count_samples(size_t planes, uint16_t (*total)[64], Part part) {
  const Bytes d;
  std::memset(total, 0, kCounts * sizeof(*total));
  for (size_t t = 0; t < planes;) {
    const size_t end = std::min(planes, t + 255);
    auto first = hn::Zero(d), second = hn::Zero(d);
    for (; t < end; ++t) part(t, first, second);
    HWY_ALIGN uint8_t counted[64];
    hn::Store(first, d, counted);
    for (size_t i = 0; i < hn::Lanes(d); ++i)
      total[0][i] = static_cast<uint16_t>(total[0][i] + counted[i]);
    if (kCounts == 1) continue;
    hn::Store(second, d, counted);
    for (size_t i = 0; i < hn::Lanes(d); ++i)
      total[kCounts - 1][i] = static_cast<uint16_t>(total[kCounts - 1][i] + counted[i]);
  }
}

// The median of each pixel's samples that are not masked, the mean of the middle two rounded down
// where their number is even; 0 where masked. level: near what it is; stays where all are masked.
// masked: how many are. The median's bits are found from the highest down: a bit is set where no
// more samples lie below than half. Where the median of no pixel is far from `level`, that begins
// near it.
void take_median(const Column& column, const uint16_t* HWY_RESTRICT masked,
                 uint8_t* HWY_RESTRICT level) {
  constexpr int kNear = 8;
  const Bytes d;
  const size_t lanes = hn::Lanes(d);
  HWY_ALIGN uint8_t median[64], candidate[64], upper[64];
  HWY_ALIGN uint16_t below[2][64], rank[64];
  const auto all = static_cast<uint16_t>(column.planes);
  for (size_t i = 0; i < lanes; ++i) {
    median[i] = static_cast<uint8_t>(std::clamp(level[i] - kNear / 2, 0, 256 - kNear));
    rank[i] = static_cast<uint16_t>(masked[i] + std::max(all - masked[i] - 1, 0) / 2);
  }
  const auto low = hn::Load(d, median), high = hn::Add(low, hn::Set(d, kNear - 1));
  count_samples<2>(column.planes, below, [&](size_t t, auto& under, auto& up_to) HWY_ATTR {
    const auto x = column.at(t);
    under = hn::Sub(under, hn::VecFromMask(d, hn::Lt(x, low)));
    up_to = hn::Sub(up_to, hn::VecFromMask(d, hn::Not(hn::Gt(x, high))));
  });
  int far = 0;
  for (size_t i = 0; i < lanes; ++i)
    far |= static_cast<int>(masked[i] != all) &
           (static_cast<int>(below[0][i] > rank[i]) | static_cast<int>(below[1][i] <= rank[i]));
  if (far) std::memset(median, 0, sizeof(median));
  for (int bit = far ? 128 : kNear / 2; bit > 0; bit /= 2) {
    for (size_t i = 0; i < lanes; ++i) candidate[i] = static_cast<uint8_t>(median[i] + bit);
    const auto limit = hn::Load(d, candidate);
    count_samples<1>(column.planes, below, [&](size_t t, auto& under, auto&) HWY_ATTR {
      under = hn::Sub(under, hn::VecFromMask(d, hn::Lt(column.at(t), limit)));
    });
    for (size_t i = 0; i < lanes; ++i)
      median[i] = below[0][i] <= rank[i] ? candidate[i] : median[i];
  }
  // The upper of the middle two is the same, or the least sample above.
  const auto lower = hn::Load(d, median);
  auto least = hn::Set(d, 255);
  count_samples<1>(column.planes, below, [&](size_t t, auto& up_to, auto&) HWY_ATTR {
    const auto x = column.at(t);
    const auto above = hn::Gt(x, lower);
    up_to = hn::Sub(up_to, hn::VecFromMask(d, hn::Not(above)));
    least = hn::IfThenElse(above, hn::Min(least, x), least);
  });
  hn::Store(least, d, upper);
  for (size_t i = 0; i < lanes; ++i) {
    if (masked[i] == all) continue;
    const int number = all - masked[i];
    const bool next = number % 2 == 0 && below[0][i] == masked[i] + number / 2;
    level[i] = static_cast<uint8_t>((median[i] + (next ? upper[i] : median[i])) / 2);
  }
}

// Samples, `planes` rows of them `stride` apart and 0 where not kept, of `count` pixels, a multiple
// of 64: what is not kept becomes the median of the others, or stays at `level` where there are
// none; others come as near to it as reach, or stay where there is no reach. keep: rows
// `keep_stride` apart. level: near the medians, which it becomes.
void fill_rows(uint8_t* samples, size_t stride, size_t planes, const uint8_t* keep,
               size_t keep_stride, const uint16_t* masked, const uint8_t* reach, size_t count,
               uint8_t* level) {
  const Bytes d;
  for (size_t first = 0; first < count; first += hn::Lanes(d)) {
    take_median({samples + first, stride, planes}, masked + first, level + first);
    // While the samples are in the first cache.
    const auto l = hn::LoadU(d, level + first);
    const auto most = reach ? hn::LoadU(d, reach + first) : hn::Set(d, 255);
    for (size_t t = 0; t < planes; ++t) {
      uint8_t* at = samples + t * stride + first;
      const auto x = hn::LoadU(d, at);
      const auto limit = hn::And(most, hn::LoadU(d, keep + t * keep_stride + first));
      const auto up = hn::Min(hn::SaturatedSub(x, l), limit);
      const auto down = hn::Min(hn::SaturatedSub(l, x), limit);
      // One of them is 0.
      hn::StoreU(hn::Sub(hn::Add(l, up), down), d, at);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(expand_bits);
HWY_EXPORT(take_row);
HWY_EXPORT(fill_rows);

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
    const int snapshot = static_cast<int>(t), next = std::min(snapshot + 1, snapshots.size() - 1);
    HWY_DYNAMIC_DISPATCH(expand_bits)(mask.of(snapshot) + first / 8, padded, keep, masked_.data());
    for (size_t c = 0; c < kChannels; ++c) {
      const float gain = gains[t][c];
      const int channel = static_cast<int>(c);
      // Planes are padded like runs.
      HWY_DYNAMIC_DISPATCH(take_row)
      (snapshots.plane(snapshot, channel) + first, keep, padded, gain == 1 ? 1 : 1 / gain,
       snapshots.plane(next, channel) + first, samples_.data() + (kChannels * t + c) * run_);
    }
  }
  uint8_t* level = samples_.data() + m * kChannels * run_;
  for (size_t c = 0; c < kChannels; ++c) {
    std::memcpy(level, reference.level[c].data() + first, count);
    std::memset(level + count, 0, padded - count);
    HWY_DYNAMIC_DISPATCH(fill_rows)
    (samples_.data() + c * run_, kChannels * run_, m, keep_.data(), run_, masked_.data(),
     reach ? reach + first : nullptr, padded, level);
  }
  return planes_.data();
}

void fill_samples(const Reference& reference, const uint8_t* bits, const uint8_t* const x[3],
                  const Gain& gain, const uint8_t* reach, int step, uint8_t* const out[3]) {
  fill_samples(reference, bits, x, gain, reach, {0, reference.height, step}, out);
}

void fill_samples(const Reference& reference, const uint8_t* bits, const uint8_t* const x[3],
                  const Gain& gain, const uint8_t* reach, const SampledRows& rows,
                  uint8_t* const out[3]) {
  const bool lit = is_lit(gain);
  size_t sample = 0;
  for (int row = rows.first; row < rows.end; row += rows.step)
    for (int col = 0; col < reference.width; col += rows.step, ++sample) {
      const auto p = static_cast<size_t>(row) * static_cast<size_t>(reference.width) +
                     static_cast<size_t>(col);
      const int limit = is_masked(bits, p) ? 0 : reach[p];
      for (size_t c = 0; c < 3; ++c) {
        const int level = reference.level[c][p];
        const int unit = lit ? out_of_light(x[c][p], gain[c]) : x[c][p];
        out[c][sample] = static_cast<uint8_t>(std::clamp(unit, level - limit, level + limit));
      }
    }
}

}  // namespace qdmd
#endif
