// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#include "core/passes/bands.h"
#include "core/passes/residual.h"
#include "core/passes/unit_light.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/mask.cpp"
#include "core/passes/simd.h"
// After simd.h.
#include "core/passes/even_odd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Passes over one row. What is a plain loop, the compiler makes vectors of for each instruction
// set.

void scale_row(const uint8_t* HWY_RESTRICT from, size_t count, const LevelMap& map,
               uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i) out[i] = in_light(from[i], map);
}

// Rows of sums are read and written here only: in which order is no matter to others. They, and
// padded rows, have room for whole vectors.
#if HWY_TARGET == HWY_SCALAR
// padded: two samples before the row's first and two after its last.
void sum_five_columns(const uint8_t* padded, size_t count, uint16_t* out) {
  for (size_t i = 0; i < count; ++i)
    out[i] = static_cast<uint16_t>(padded[i] + padded[i + 1] + padded[i + 2] + padded[i + 3] +
                                   padded[i + 4]);
}

uint16_t sum_five(const uint16_t* const* rows, size_t i) {
  return static_cast<uint16_t>(rows[0][i] + rows[1][i] + rows[2][i] + rows[3][i] + rows[4][i]);
}

// Makes five rows of sums the mean of 25 samples, rounded.
void mean_row(const uint16_t* const* rows, size_t count, uint8_t* out) {
  for (size_t i = 0; i < count; ++i) out[i] = static_cast<uint8_t>((sum_five(rows, i) + 12) / 25);
}

// 1 where the five rows' sums exceed 25 thresholds.
void exceed_row(const uint16_t* const* rows, const uint8_t* threshold, size_t count, uint8_t* out) {
  for (size_t i = 0; i < count; ++i) out[i] = sum_five(rows, i) > 25 * threshold[i];
}
#else
void sum_five_columns(const uint8_t* HWY_RESTRICT padded, size_t count,
                      uint16_t* HWY_RESTRICT out) {
  const EvenOdd::Bytes d;
  const EvenOdd::Words d16;
  for (size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto before = hn::LoadU(d, padded + i), here = hn::LoadU(d, padded + i + 2),
               after = hn::LoadU(d, padded + i + 4);
    // What a pixel at an even place and the one after it have in common.
    const auto both = hn::Add(hn::Add(EvenOdd::odd(before), EvenOdd::even(here)),
                              hn::Add(EvenOdd::odd(here), EvenOdd::even(after)));
    hn::StoreU(hn::Add(both, EvenOdd::even(before)), d16, out + i);
    hn::StoreU(hn::Add(both, EvenOdd::odd(after)), d16, out + i + hn::Lanes(d16));
  }
}

HWY_INLINE EvenOdd::V16 sum_five(const uint16_t* const* rows, size_t i) {
  const EvenOdd::Words d;
  const auto row = [&](size_t k) HWY_ATTR { return hn::LoadU(d, rows[k] + i); };
  return hn::Add(hn::Add(hn::Add(row(0), row(1)), hn::Add(row(2), row(3))), row(4));
}

// Calls vector(i, sums at even places, at odd ones, size) for the vectors of a row; size: pixels of
// them that are the row's.
template <class Vector>
HWY_INLINE void for_sums(const uint16_t* const* rows, size_t count, const Vector& vector) {
  const size_t lanes = hn::Lanes(EvenOdd::Bytes());
  for (size_t i = 0; i < count; i += lanes)
    vector(i, sum_five(rows, i), sum_five(rows, i + hn::Lanes(EvenOdd::Words())),
           std::min(lanes, count - i));
}

void mean_row(const uint16_t* const* rows, size_t count, uint8_t* HWY_RESTRICT out) {
  const EvenOdd::Bytes d;
  const EvenOdd::Words d16;
  // (sum + 12) / 25, for sums of 25 bytes.
  const auto mean = [&](EvenOdd::V16 sum) HWY_ATTR {
    return hn::ShiftRight<1>(
        hn::MulHigh(hn::Add(sum, hn::Set(d16, uint16_t{12})), hn::Set(d16, uint16_t{5243})));
  };
  for_sums(rows, count, [&](size_t i, EvenOdd::V16 even, EvenOdd::V16 odd, size_t size) HWY_ATTR {
    const auto means = EvenOdd::joined(mean(even), mean(odd));
    if (size == hn::Lanes(d)) {
      hn::StoreU(means, d, out + i);
      return;
    }
    HWY_ALIGN uint8_t last[HWY_MAX_BYTES];
    hn::Store(means, d, last);
    std::memcpy(out + i, last, size);
  });
}

void exceed_row(const uint16_t* const* rows, const uint8_t* HWY_RESTRICT threshold, size_t count,
                uint8_t* HWY_RESTRICT out) {
  const EvenOdd::Bytes d;
  const EvenOdd::Words d16;
  const auto exceed = [&](EvenOdd::V16 sum, EvenOdd::V16 limit) HWY_ATTR {
    const auto over = hn::SaturatedSub(sum, hn::Mul(limit, hn::Set(d16, uint16_t{25})));
    return hn::Min(over, hn::Set(d16, uint16_t{1}));
  };
  for_sums(rows, count, [&](size_t i, EvenOdd::V16 even, EvenOdd::V16 odd, size_t size) HWY_ATTR {
    HWY_ALIGN uint8_t last[HWY_MAX_BYTES] = {};
    const uint8_t* limits = threshold + i;
    if (size < hn::Lanes(d)) {
      std::memcpy(last, limits, size);
      limits = last;
    }
    const auto limit = hn::LoadU(d, limits);
    hn::StoreU(
        EvenOdd::joined(exceed(even, EvenOdd::even(limit)), exceed(odd, EvenOdd::odd(limit))), d,
        out + i);
  });
}
#endif

// padded: three samples before the row's first and three after its last.
void sum_seven_columns(const uint8_t* HWY_RESTRICT padded, size_t count,
                       uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i)
    out[i] = static_cast<uint8_t>(padded[i] + padded[i + 1] + padded[i + 2] + padded[i + 3] +
                                  padded[i + 4] + padded[i + 5] + padded[i + 6]);
}

// 1 where most of 7 x 7 are.
void most_row(const uint8_t* const* rows, size_t count, uint8_t* HWY_RESTRICT out) {
  const uint8_t *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3], *e = rows[4], *f = rows[5],
                *g = rows[6];
  for (size_t i = 0; i < count; ++i)
    out[i] = static_cast<uint8_t>(a[i] + b[i] + c[i] + d[i] + e[i] + f[i] + g[i]) > 24;
}

// One bit for each of `count` samples, set where they are not 0. Samples are readable, and bits
// are written, up to the next multiple of 64.
void pack_bits(const uint8_t* samples, size_t count, uint8_t* bits) {
  const hn::CappedTag<uint8_t, 64> d;
  const size_t lanes = hn::Lanes(d);
  const auto zero = hn::Zero(d);
  const size_t whole = 8 * mask_bytes(count);
  if (lanes < 8) {
    std::memset(bits, 0, whole / 8);
    for (size_t i = 0; i < whole; ++i)
      bits[i / 8] = static_cast<uint8_t>(bits[i / 8] | (samples[i] != 0) << i % 8);
    return;
  }
  for (size_t i = 0; i < whole; i += lanes)
    hn::StoreMaskBits(d, hn::Gt(hn::LoadU(d, samples + i), zero), bits + i / 8);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(scale_row);
HWY_EXPORT(sum_five_columns);
HWY_EXPORT(mean_row);
HWY_EXPORT(exceed_row);
HWY_EXPORT(sum_seven_columns);
HWY_EXPORT(most_row);
HWY_EXPORT(pack_bits);

// Samples that pack_bits() may read behind the last.
constexpr size_t kBitsRead = 64;

// Pixels whose bits are whole bytes, and whole vectors.
constexpr size_t kBitsPacked = 64;
constexpr size_t whole_vectors(size_t width) {
  return (width + kBitsPacked - 1) / kBitsPacked * kBitsPacked;
}

// Rows of a mask that are packed together: they stay in the first-level cache.
size_t mask_rows(size_t width, int height) {
  constexpr size_t kMost = 16384;
  return std::clamp<size_t>(kMost / width, 1, static_cast<size_t>(height));
}

constexpr int kMeanReach = 2, kMajorityReach = 3;  // pixels around one that judge it with it

// Repeats the first and the last of `width` samples that begin at padded[reach].
void pad_ends(size_t width, size_t reach, uint8_t* padded) {
  std::memset(padded, padded[reach], reach);
  std::memset(padded + reach + width, padded[reach + width - 1], reach);
}

// The last 2 kReach + 1 rows of a picture.
template <typename T, int kReach>
class RowRing {
 public:
  static constexpr int kRows = 2 * kReach + 1;
  RowRing(T* memory, size_t width) : memory_(memory), width_(width) {}
  T* of(int row) { return memory_ + static_cast<size_t>(row % kRows) * width_; }
  // The rows around `row`; the picture's first and last stand for those outside.
  std::array<const T*, kRows> around(int row, int height) {
    std::array<const T*, kRows> rows;
    for (int i = 0; i < kRows; ++i)
      rows[static_cast<size_t>(i)] = of(std::clamp(row + i - kReach, 0, height - 1));
    return rows;
  }

 private:
  T* memory_;
  size_t width_;
};
using SumRing = RowRing<uint16_t, kMeanReach>;
using CountRing = RowRing<uint8_t, kMajorityReach>;

}  // namespace

size_t mask_scratch_bytes(int width, int height) {
  const auto w = static_cast<size_t>(width);
  const size_t whole = whole_vectors(w);
  const size_t bytes = 2 * whole * SumRing::kRows + w * CountRing::kRows + 5 * w +
                       (whole + 2 * kMajorityReach) + mask_rows(w, height) * w + kBitsPacked +
                       kBitsRead;
  // The next thread's begins at an even address, too.
  return bytes + bytes % 2;
}

void find_mask(const ReferencePicture& reference, const KeptPicture& x, const SampleLight& light,
               uint8_t* bits, uint8_t* scratch) noexcept {
  const int height = reference.height;
  const auto width = static_cast<size_t>(reference.width);
  const bool lit = light.changes();
  const auto take = [&scratch](size_t bytes) { return std::exchange(scratch, scratch + bytes); };
  const size_t whole = whole_vectors(width);
  SumRing sums(reinterpret_cast<uint16_t*>(take(2 * whole * SumRing::kRows)), whole);
  CountRing counts(take(width * CountRing::kRows), width);
  uint8_t* const lit_rows[3] = {take(width), take(width), take(width)};
  uint8_t* const padded = take(whole + 2 * kMajorityReach);
  const size_t rows_together = mask_rows(width, height);
  uint8_t* const mask = take(rows_together * width + kBitsPacked + kBitsRead);
  RowReader reader(x, reference.width, take(2 * width));

  const auto add_norm = [&](int row) {
    const size_t start = static_cast<size_t>(row) * width;
    const uint8_t* l[3];
    for (size_t c = 0; c < 3; ++c) {
      l[c] = reference.level[c].data() + start;
      if (!lit) continue;
      HWY_DYNAMIC_DISPATCH(scale_row)(l[c], width, light.into(c), lit_rows[c]);
      l[c] = lit_rows[c];
    }
    const uint8_t* row_of_x[3];
    reader.read(row, row_of_x);
    residual_norm(row_of_x, l, width, padded + kMeanReach);
    pad_ends(width, kMeanReach, padded);
    HWY_DYNAMIC_DISPATCH(sum_five_columns)(padded, width, sums.of(row));
  };
  const auto add_count = [&](int row) {
    HWY_DYNAMIC_DISPATCH(exceed_row)
    (sums.around(row, height).data(), reference.threshold.data() + static_cast<size_t>(row) * width,
     width, padded + kMajorityReach);
    pad_ends(width, kMajorityReach, padded);
    HWY_DYNAMIC_DISPATCH(sum_seven_columns)(padded, width, counts.of(row));
  };
  int norms = 0, counted = 0;
  size_t waiting = 0;  // pixels of the mask that are not packed yet, fewer than kBitsPacked of them
                       // of rows before
  for (int row = 0; row < height; ++row) {
    for (; counted < std::min(height, row + kMajorityReach + 1); ++counted) {
      for (; norms < std::min(height, counted + kMeanReach + 1); ++norms) add_norm(norms);
      add_count(counted);
    }
    HWY_DYNAMIC_DISPATCH(most_row)
    (counts.around(row, height).data(), width, mask + waiting);
    waiting += width;
    const bool last = row + 1 == height;
    if (!last && (static_cast<size_t>(row) + 1) % rows_together != 0) continue;
    const size_t packed = last ? waiting : waiting / kBitsPacked * kBitsPacked;
    if (last) std::memset(mask + waiting, 0, kBitsRead);
    HWY_DYNAMIC_DISPATCH(pack_bits)(mask, packed, bits);
    bits += packed / 8;
    waiting -= packed;
    std::memmove(mask, mask + packed, waiting);
  }
}

GainSums gain_sums(const ReferencePicture& reference, const KeptPicture& x,
                   const SampleLight& light, const SampledRows& rows, int bright) {
  int64_t product[kChannels] = {}, square[kChannels] = {}, fit = 0, seen = 0;
  int tint[kChannels];
  for (size_t c = 0; c < kChannels; ++c) tint[c] = static_cast<int>(std::lround(light.tint[c]));
  SampleFinder samples(x, reference.width);
  for (int row = rows.first; row < rows.end; row += rows.step) {
    samples.seek(row);
    for (int col = 0; col < reference.width; col += rows.step, ++seen) {
      const auto p = static_cast<size_t>(row) * static_cast<size_t>(reference.width) +
                     static_cast<size_t>(col);
      float squared = 0;
      int brightest = 0;
      int own[kChannels], level[kChannels];  // above dark
      for (size_t c = 0; c < 3; ++c) {
        const int sample = samples.at(c, static_cast<size_t>(col));
        own[c] = sample - light.range.dark[c] - tint[c];
        level[c] = reference.level[c][p] - light.range.dark[c];
        const float away =
            static_cast<float>(own[c]) - static_cast<float>(level[c]) * light.gain[c];
        squared += away * away;
        brightest = std::max(brightest, sample);
      }
      const float limit = reference.threshold[p];
      if (squared >= limit * limit || brightest >= bright) continue;
      ++fit;
      for (size_t c = 0; c < 3; ++c) {
        product[c] += own[c] * level[c];
        square[c] += level[c] * level[c];
      }
    }
  }
  return {product[0], product[1], product[2], square[0], square[1], square[2], fit, seen};
}

bool refine_gain(const GainSums& sums, Gain* gain, bool one_gain) {
  const auto fit = static_cast<double>(sums[2 * kChannels]),
             seen = static_cast<double>(sums[2 * kChannels + 1]);
  if (fit < kLeastFits * seen) return false;
  if (one_gain) {
    const auto product = static_cast<double>(sums[0] + sums[1] + sums[2]),
               square = static_cast<double>(sums[3] + sums[4] + sums[5]);
    const auto more = static_cast<float>(product / square) / luma_gain(*gain);
    if (product > 0)
      for (float& of_channel : *gain) of_channel *= more;
    return true;
  }
  for (size_t c = 0; c < kChannels; ++c)
    if (sums[c] > 0)
      (*gain)[c] = static_cast<float>(static_cast<double>(sums[c]) /
                                      static_cast<double>(sums[kChannels + c]));
  return true;
}

namespace {

// What blur() needs for rows of a width: sums, and a padded row.
size_t blur_scratch(size_t width) {
  return 2 * whole_vectors(width) * SumRing::kRows + whole_vectors(width) + 2 * kMeanReach;
}

// Rows first .. end - 1.
void blur_rows(const uint8_t* plane, size_t width, int height, int first, int end, uint8_t* scratch,
               uint8_t* out) {
  auto* const sums = reinterpret_cast<uint16_t*>(scratch);
  SumRing ring(sums, whole_vectors(width));
  auto* const padded = reinterpret_cast<uint8_t*>(sums + whole_vectors(width) * SumRing::kRows);
  int next = std::max(0, first - kMeanReach);
  for (int row = first; row < end; ++row) {
    for (; next < std::min(height, row + kMeanReach + 1); ++next) {
      std::memcpy(padded + kMeanReach, plane + static_cast<size_t>(next) * width, width);
      pad_ends(width, kMeanReach, padded);
      HWY_DYNAMIC_DISPATCH(sum_five_columns)(padded, width, ring.of(next));
    }
    HWY_DYNAMIC_DISPATCH(mean_row)
    (ring.around(row, height).data(), width, out + static_cast<size_t>(row) * width);
  }
}

}  // namespace

uint64_t blur_bytes(int width, int threads) {
  return blur_scratch(static_cast<size_t>(width)) * static_cast<uint64_t>(threads);
}

void blur(const uint8_t* plane, int width, int height, Pool* pool, uint8_t* out) {
  constexpr int kRows = 32;  // of a part
  const auto w = static_cast<size_t>(width);
  const size_t size = blur_scratch(w);
  const auto scratch = std::make_unique_for_overwrite<uint8_t[]>(size * pool->threads());
  for_bands(*pool, height, (height + kRows - 1) / kRows, [&](int first, int rows, size_t worker) {
    blur_rows(plane, w, height, first, first + rows, scratch.get() + worker * size, out);
  });
}

}  // namespace qdmd
#endif
