// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/digits.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include "core/passes/chroma.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/digits.cpp"
#include "core/passes/simd.h"

// Words in memory are little-endian, as this machine's.
static_assert(std::endian::native == std::endian::little);

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Plain loops, which the compiler makes vectors of.

HWY_INLINE uint16_t word_at(const uint8_t* from) {
  uint16_t word;
  std::memcpy(&word, from, sizeof(word));
  return word;
}

HWY_INLINE void set_word(uint8_t* to, uint16_t word) { std::memcpy(to, &word, sizeof(word)); }

template <size_t kStride>
HWY_INLINE void split(const uint8_t* HWY_RESTRICT from, int shift, int low_bits, size_t count,
                      uint8_t* HWY_RESTRICT high, uint8_t* HWY_RESTRICT low) {
  const auto mask = static_cast<uint16_t>((1 << low_bits) - 1);
  const int up = shift + low_bits;
  for (size_t p = 0; p < count; ++p) {
    const uint16_t word = word_at(from + p * kStride);
    high[p] = static_cast<uint8_t>(word >> up);
    low[p] = static_cast<uint8_t>((word >> shift) & mask);
  }
}

// stride: 2, 4 or 8.
void split_row(const uint8_t* from, size_t stride, int shift, int low_bits, size_t count,
               uint8_t* high, uint8_t* low) {
  if (stride == 2)
    split<2>(from, shift, low_bits, count, high, low);
  else if (stride == 4)
    split<4>(from, shift, low_bits, count, high, low);
  else
    split<8>(from, shift, low_bits, count, high, low);
}

void join_row(const uint8_t* HWY_RESTRICT high, const uint8_t* HWY_RESTRICT low, int low_bits,
              size_t count, uint16_t* HWY_RESTRICT out) {
  for (size_t p = 0; p < count; ++p) out[p] = static_cast<uint16_t>(high[p] << low_bits | low[p]);
}

void put_row(const uint16_t* HWY_RESTRICT samples, int shift, size_t count,
             uint8_t* HWY_RESTRICT to) {
  for (size_t p = 0; p < count; ++p)
    set_word(to + 2 * p, static_cast<uint16_t>(samples[p] << shift));
}

void put_pairs_row(const uint16_t* HWY_RESTRICT first, const uint16_t* HWY_RESTRICT second,
                   int shift, size_t count, uint8_t* HWY_RESTRICT to) {
  size_t p = 0;
  const hn::ScalableTag<uint16_t> d;
  const hn::Repartition<uint8_t, decltype(d)> d8;
  const size_t lanes = hn::Lanes(d);
#if HWY_TARGET != HWY_SCALAR
  for (; p + lanes <= count; p += lanes) {
    const auto a = hn::ShiftLeftSame(hn::LoadU(d, first + p), shift);
    const auto b = hn::ShiftLeftSame(hn::LoadU(d, second + p), shift);
    // Bytes: the words may be at any address.
    HWY_ALIGN uint16_t pairs[2 * HWY_MAX_BYTES / sizeof(uint16_t)];
    hn::StoreInterleaved2(a, b, d, pairs);
    const auto* bytes = reinterpret_cast<const uint8_t*>(pairs);
    hn::StoreU(hn::Load(d8, bytes), d8, to + 4 * p);
    hn::StoreU(hn::Load(d8, bytes + 2 * lanes), d8, to + 4 * p + 2 * lanes);
  }
#else
  (void)d8, (void)lanes;
#endif
  for (; p < count; ++p) {
    set_word(to + 4 * p, static_cast<uint16_t>(first[p] << shift));
    set_word(to + 4 * p + 2, static_cast<uint16_t>(second[p] << shift));
  }
}

void put_fours_row(const uint16_t* const samples[4], int shift, size_t count,
                   uint8_t* HWY_RESTRICT to) {
  size_t p = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::ScalableTag<uint16_t> d;
  const hn::Repartition<uint8_t, decltype(d)> d8;
  const size_t lanes = hn::Lanes(d);
  for (; p + lanes <= count; p += lanes) {
    const auto at = [&](size_t c)
                        HWY_ATTR { return hn::ShiftLeftSame(hn::LoadU(d, samples[c] + p), shift); };
    HWY_ALIGN uint16_t fours[4 * HWY_MAX_BYTES / sizeof(uint16_t)];
    hn::StoreInterleaved4(at(0), at(1), at(2), at(3), d, fours);
    const auto* bytes = reinterpret_cast<const uint8_t*>(fours);
    for (size_t i = 0; i < 4; ++i)
      hn::StoreU(hn::Load(d8, bytes + 2 * i * lanes), d8, to + 8 * p + 2 * i * lanes);
  }
#endif
  for (; p < count; ++p)
    for (size_t c = 0; c < 4; ++c)
      set_word(to + 8 * p + 2 * c, static_cast<uint16_t>(samples[c][p] << shift));
}

template <bool kTwoRows>
HWY_INLINE void mean(const uint16_t* HWY_RESTRICT above, const uint16_t* HWY_RESTRICT below,
                     size_t pairs, uint16_t* HWY_RESTRICT out) {
  for (size_t k = 0; k < pairs; ++k) {
    const uint32_t upper = uint32_t{above[2 * k]} + above[2 * k + 1];
    if constexpr (kTwoRows)
      out[k] = static_cast<uint16_t>((upper + below[2 * k] + below[2 * k + 1] + 2) >> 2);
    else
      out[k] = static_cast<uint16_t>((upper + 1) >> 1);
  }
}

void mean_row(const uint16_t* above, const uint16_t* below, size_t pairs, uint16_t* out) {
  if (below)
    mean<true>(above, below, pairs, out);
  else
    mean<false>(above, above, pairs, out);
}

void fit_row(const uint8_t* HWY_RESTRICT x, uint16_t black, uint16_t white, size_t count,
             uint16_t* HWY_RESTRICT out) {
  const auto range = static_cast<uint32_t>(white - black);
  for (size_t p = 0; p < count; ++p)
    out[p] = static_cast<uint16_t>(black + (x[p] * range + 127) / 255);
}

void residual_row(const uint16_t* HWY_RESTRICT x, const uint16_t* HWY_RESTRICT l, uint16_t black,
                  uint16_t white, size_t count, uint16_t* HWY_RESTRICT out) {
  for (size_t p = 0; p < count; ++p) {
    const auto distance = static_cast<uint16_t>(std::max(x[p], l[p]) - std::min(x[p], l[p]));
    const auto most = static_cast<uint16_t>(white - black);
    out[p] = static_cast<uint16_t>(black + std::min(distance, most));
  }
}

void fade_row(const uint16_t* HWY_RESTRICT x, const uint8_t* HWY_RESTRICT alpha, uint16_t black,
              size_t count, uint16_t* HWY_RESTRICT out) {
  for (size_t p = 0; p < count; ++p) {
    const uint32_t a = alpha[p];
    out[p] = static_cast<uint16_t>((x[p] * a + black * (255 - a) + 127) / 255);
  }
}

// Plain loops, which the compiler makes vectors of; Word holds a sum of three squares.
template <typename Word>
HWY_INLINE void add_squares(const uint8_t* const* high, const uint8_t* const* low, int low_bits,
                            const uint16_t* const* l, size_t count, uint64_t* HWY_RESTRICT out) {
  const uint8_t *hr = high[0], *hg = high[1], *hb = high[2];
  const uint8_t *lr = low[0], *lg = low[1], *lb = low[2];
  const uint16_t *r = l[0], *g = l[1], *b = l[2];
  const auto square = [low_bits](uint8_t of_high, uint8_t of_low, uint16_t of_l) HWY_ATTR {
    const auto difference =
        static_cast<std::make_signed_t<Word>>((of_high << low_bits) + of_low - of_l);
    return static_cast<Word>(difference * difference);
  };
  for (size_t p = 0; p < count; ++p) {
    const Word sum =
        square(hr[p], lr[p], r[p]) + square(hg[p], lg[p], g[p]) + square(hb[p], lb[p], b[p]);
    out[p] = sum;
  }
}

void squared_units(const uint8_t* const* high, const uint8_t* const* low, int low_bits,
                   const uint16_t* const* l, size_t count, uint64_t* HWY_RESTRICT out) {
  // 3 (2^12)^2 is below 2^32.
  if (low_bits <= 4)
    add_squares<uint32_t>(high, low, low_bits, l, count, out);
  else
    add_squares<uint64_t>(high, low, low_bits, l, count, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(squared_units);
HWY_EXPORT(split_row);
HWY_EXPORT(join_row);
HWY_EXPORT(put_row);
HWY_EXPORT(put_pairs_row);
HWY_EXPORT(put_fours_row);
HWY_EXPORT(mean_row);
HWY_EXPORT(fit_row);
HWY_EXPORT(residual_row);
HWY_EXPORT(fade_row);

}  // namespace

void split_digits(const uint8_t* from, ptrdiff_t stride, SampleBits bits, size_t count,
                  MutableSamples to) {
  if (stride == 2 || stride == 4 || stride == 8) {
    HWY_DYNAMIC_DISPATCH(split_row)
    (from, static_cast<size_t>(stride), bits.shift, bits.low(), count, to.high, to.low);
    return;
  }
  for (size_t p = 0; p < count; ++p) HWY_DYNAMIC_DISPATCH(split_row)
  (from + static_cast<ptrdiff_t>(p) * stride, 2, bits.shift, bits.low(), 1, to.high + p,
   to.low + p);
}

void split_digits(const uint16_t* from, int depth, size_t count, MutableSamples to) {
  split_digits(reinterpret_cast<const uint8_t*>(from), sizeof(uint16_t), {depth, 0}, count, to);
}

void join_digits(Samples from, int depth, size_t count, uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(join_row)(from.high, from.low, bits_below(depth), count, out);
}

void take_row(const uint8_t* from, const Spacing& at, SampleBits bits, size_t count, uint8_t* room,
              MutableSamples to) {
  const auto columns = static_cast<size_t>(at.columns);
  if (!bits.is_deep()) {
    spread_samples(from, at.pixel_stride, at.columns, count, to.high);
  } else if (columns == 1) {
    split_digits(from, at.pixel_stride, bits, count, to);
  } else {
    const MutableSamples shared(room, room + count);
    split_digits(from, at.pixel_stride, bits, (count + columns - 1) / columns, shared);
    spread_samples(shared.high, 1, at.columns, count, to.high);
    spread_samples(shared.low, 1, at.columns, count, to.low);
  }
}

bool are_all(Samples samples, Samples value, size_t count) {
  return are_all(samples.high, *value.high, count) &&
         (!samples.low || are_all(samples.low, *value.low, count));
}

void put_words(const uint16_t* samples, SampleBits bits, size_t count, uint8_t* to,
               ptrdiff_t stride) {
  if (stride == 2) {
    HWY_DYNAMIC_DISPATCH(put_row)(samples, bits.shift, count, to);
    return;
  }
  for (size_t p = 0; p < count; ++p, to += stride) {
    const auto word = static_cast<uint16_t>(samples[p] << bits.shift);
    std::memcpy(to, &word, sizeof(word));
  }
}

void put_pairs(const uint16_t* const samples[2], SampleBits bits, size_t count, uint8_t* to) {
  HWY_DYNAMIC_DISPATCH(put_pairs_row)(samples[0], samples[1], bits.shift, count, to);
}

void put_fours(const uint16_t* const samples[4], SampleBits bits, size_t count, uint8_t* to) {
  HWY_DYNAMIC_DISPATCH(put_fours_row)(samples, bits.shift, count, to);
}

void mean_of_pairs(const uint16_t* above, const uint16_t* below, size_t count, uint16_t* out) {
  const size_t pairs = count / 2;
  HWY_DYNAMIC_DISPATCH(mean_row)(above, below, pairs, out);
  if (count % 2 == 0) return;
  const uint16_t* second = below ? below : above;
  out[pairs] = static_cast<uint16_t>((above[count - 1] + second[count - 1] + 1) / 2);
}

void fit_levels(const uint8_t* x, uint16_t black, uint16_t white, size_t count, uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(fit_row)(x, black, white, count, out);
}

void residual_levels(const uint16_t* x, const uint16_t* l, uint16_t black, uint16_t white,
                     size_t count, uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(residual_row)(x, l, black, white, count, out);
}

void fade(const uint16_t* x, const uint8_t* alpha, uint16_t black, size_t count, uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(fade_row)(x, alpha, black, count, out);
}

void squared_units(const Samples x[3], int depth, const uint16_t* const l[3], size_t count,
                   uint64_t* out) {
  const uint8_t* const high[3] = {x[0].high, x[1].high, x[2].high};
  const uint8_t* const low[3] = {x[0].low, x[1].low, x[2].low};
  HWY_DYNAMIC_DISPATCH(squared_units)(high, low, bits_below(depth), l, count, out);
}

}  // namespace qdmd
#endif
