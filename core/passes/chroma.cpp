// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/chroma.h"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/chroma.cpp"
#include "core/passes/simd.h"
// After simd.h.
#include "core/passes/even_odd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// At most 16 samples, for what is left of narrow rows.
using Few = hn::CappedTag<uint8_t, 16>;
using Many = hn::ScalableTag<uint8_t>;

// So many samples as a vector has, kStride bytes apart; `from` is the first of them. Reads up to
// kStride - 1 bytes behind the last.
template <size_t kStride, class D>
HWY_INLINE hn::Vec<D> load_first(D d, const uint8_t* from) {
  if constexpr (kStride == 1) {
    return hn::LoadU(d, from);
  } else if constexpr (kStride == 2) {
    hn::Vec<D> v0, v1;
    hn::LoadInterleaved2(d, from, v0, v1);
    return v0;
  } else {
    hn::Vec<D> v0, v1, v2, v3;
    hn::LoadInterleaved4(d, from, v0, v1, v2, v3);
    return v0;
  }
}

// load_first(), but it reads up to kStride - 1 bytes before the first.
template <size_t kStride, class D>
HWY_INLINE hn::Vec<D> load_last(D d, const uint8_t* from) {
  if constexpr (kStride == 1) {
    return hn::LoadU(d, from);
  } else if constexpr (kStride == 2) {
    hn::Vec<D> v0, v1;
    hn::LoadInterleaved2(d, from - 1, v0, v1);
    return v1;
  } else {
    hn::Vec<D> v0, v1, v2, v3;
    hn::LoadInterleaved4(d, from - 3, v0, v1, v2, v3);
    return v3;
  }
}

template <size_t kColumns, class D>
HWY_INLINE void store(hn::Vec<D> v, D d, uint8_t* to) {
  if constexpr (kColumns == 1)
    hn::StoreU(v, d, to);
  else
    hn::StoreInterleaved2(v, v, d, to);
}

// Each of `count` samples kColumns times. False where they do not fill more than a vector.
template <size_t kStride, size_t kColumns, class D>
HWY_INLINE bool spread_vectors(D d, const uint8_t* from, size_t count, uint8_t* to) {
  const size_t lanes = hn::Lanes(d);
  if (count <= lanes) return false;
  size_t p = 0;
  for (; p + lanes < count; p += lanes)
    store<kColumns>(load_first<kStride>(d, from + p * kStride), d, to + p * kColumns);
  p = count - lanes;
  store<kColumns>(load_last<kStride>(d, from + p * kStride), d, to + p * kColumns);
  return true;
}

template <size_t kStride, size_t kColumns>
HWY_INLINE void spread(const uint8_t* from, size_t count, uint8_t* to) {
  if (spread_vectors<kStride, kColumns>(Many(), from, count, to)) return;
  if (spread_vectors<kStride, kColumns>(Few(), from, count, to)) return;
  for (size_t p = 0; p < count; ++p)
    for (size_t i = 0; i < kColumns; ++i) to[p * kColumns + i] = from[p * kStride];
}

// count: of samples that are read.
void spread_row(const uint8_t* from, size_t stride, size_t columns, size_t count, uint8_t* to) {
  if (columns == 1) {
    if (stride == 2)
      spread<2, 1>(from, count, to);
    else
      spread<4, 1>(from, count, to);
    return;
  }
  if (stride == 1)
    spread<1, 2>(from, count, to);
  else if (stride == 2)
    spread<2, 2>(from, count, to);
  else
    spread<4, 2>(from, count, to);
}

#if HWY_TARGET != HWY_SCALAR
// The mean of each two neighbours in both rows, a half of a vector of bytes.
template <bool kTwoRows, class D>
HWY_INLINE void mean_vector(D d, const uint8_t* above, const uint8_t* below, uint8_t* out) {
  const hn::Repartition<uint16_t, D> d16;
  const hn::RebindToSigned<decltype(d16)> d16s;
  const hn::Half<D> half;
  const auto low = hn::Set(d16, 0x00FF);
  const auto pairs = [&](const uint8_t* from) HWY_ATTR {
    const auto both = hn::BitCast(d16, hn::LoadU(d, from));
    return hn::Add(hn::And(both, low), hn::ShiftRight<8>(both));
  };
  auto sum = pairs(above);
  if constexpr (kTwoRows)
    sum = hn::ShiftRight<2>(hn::Add(hn::Add(sum, pairs(below)), hn::Set(d16, 2)));
  else
    sum = hn::ShiftRight<1>(hn::Add(sum, hn::Set(d16, 1)));
  hn::StoreU(hn::DemoteTo(half, hn::BitCast(d16s, sum)), half, out);
}

// The means of `pairs` whole pairs. Returns how many were done: all, or none.
template <bool kTwoRows, class D>
HWY_INLINE size_t mean_vectors(D d, const uint8_t* above, const uint8_t* below, size_t pairs,
                               uint8_t* out) {
  const size_t step = hn::Lanes(d) / 2;
  if (pairs < step) return 0;
  size_t k = 0;
  for (; k + step <= pairs; k += step)
    mean_vector<kTwoRows>(d, above + 2 * k, below + 2 * k, out + k);
  // The last ones once more with some before them.
  if (k < pairs) {
    k = pairs - step;
    mean_vector<kTwoRows>(d, above + 2 * k, below + 2 * k, out + k);
  }
  return pairs;
}
#endif

#if HWY_TARGET == HWY_SCALAR
size_t mean_row(const uint8_t*, const uint8_t*, size_t, uint8_t*) { return 0; }
#else
size_t mean_row(const uint8_t* above, const uint8_t* below, size_t pairs, uint8_t* out) {
  size_t done = below ? mean_vectors<true>(Many(), above, below, pairs, out)
                      : mean_vectors<false>(Many(), above, above, pairs, out);
  if (done == 0)
    done = below ? mean_vectors<true>(Few(), above, below, pairs, out)
                 : mean_vectors<false>(Few(), above, above, pairs, out);
  return done;
}
#endif

template <class D>
HWY_INLINE bool interleave_vectors(D d, const uint8_t* first, const uint8_t* second, size_t count,
                                   uint8_t* out) {
  const size_t lanes = hn::Lanes(d);
  if (count < lanes) return false;
  size_t k = 0;
  for (; k + lanes <= count; k += lanes)
    hn::StoreInterleaved2(hn::LoadU(d, first + k), hn::LoadU(d, second + k), d, out + 2 * k);
  if (k == count) return true;
  k = count - lanes;
  hn::StoreInterleaved2(hn::LoadU(d, first + k), hn::LoadU(d, second + k), d, out + 2 * k);
  return true;
}

void interleave_row(const uint8_t* first, const uint8_t* second, size_t count, uint8_t* out) {
  if (interleave_vectors(Many(), first, second, count, out)) return;
  if (interleave_vectors(Few(), first, second, count, out)) return;
  for (size_t k = 0; k < count; ++k) out[2 * k] = first[k], out[2 * k + 1] = second[k];
}

// From sample p on.
void fit_some(const uint8_t* x, uint8_t black, uint8_t white, size_t p, size_t count,
              uint8_t* out) {
  const auto range = static_cast<uint16_t>(white - black);
  for (; p < count; ++p) {
    const auto sum = static_cast<uint16_t>(x[p] * range + 127);
    // sum / 255
    out[p] = static_cast<uint8_t>(black + (static_cast<uint16_t>(sum + 1 + (sum >> 8)) >> 8));
  }
}

#if HWY_TARGET == HWY_SCALAR
void fit_row(const uint8_t* x, uint8_t black, uint8_t white, size_t count, uint8_t* out) {
  fit_some(x, black, white, 0, count, out);
}
#else
void fit_row(const uint8_t* x, uint8_t black, uint8_t white, size_t count, uint8_t* out) {
  const EvenOdd::Bytes d;
  const EvenOdd::Words d16;
  const auto range = hn::Set(d16, static_cast<uint16_t>(white - black));
  const auto fit = [&](EvenOdd::V16 level) HWY_ATTR {
    const auto sum = hn::Add(hn::Mul(level, range), hn::Set(d16, uint16_t{127}));
    const auto more = hn::Add(hn::ShiftRight<8>(sum), hn::Set(d16, uint16_t{1}));
    return hn::ShiftRight<8>(hn::Add(sum, more));
  };
  size_t p = 0;
  for (; p + hn::Lanes(d) <= count; p += hn::Lanes(d)) {
    const auto level = hn::LoadU(d, x + p);
    const auto fitted = EvenOdd::joined(fit(EvenOdd::even(level)), fit(EvenOdd::odd(level)));
    hn::StoreU(hn::Add(fitted, hn::Set(d, black)), d, out + p);
  }
  fit_some(x, black, white, p, count, out);
}
#endif

// Plain loops, which the compiler makes vectors of.
void residual_row(const uint8_t* HWY_RESTRICT x, const uint8_t* HWY_RESTRICT l, uint8_t black,
                  uint8_t white, size_t count, uint8_t* HWY_RESTRICT out) {
  for (size_t p = 0; p < count; ++p) {
    const auto distance = static_cast<uint8_t>(std::max(x[p], l[p]) - std::min(x[p], l[p]));
    const auto most = static_cast<uint8_t>(white - black);
    out[p] = static_cast<uint8_t>(black + std::min(distance, most));
  }
}

bool all_row(const uint8_t* HWY_RESTRICT samples, uint8_t value, size_t count) {
  uint8_t others = 0;
  for (size_t p = 0; p < count; ++p) others |= static_cast<uint8_t>(samples[p] ^ value);
  return others == 0;
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(spread_row);
HWY_EXPORT(mean_row);
HWY_EXPORT(interleave_row);
HWY_EXPORT(fit_row);
HWY_EXPORT(residual_row);
HWY_EXPORT(all_row);

}  // namespace

void spread_samples(const uint8_t* from, ptrdiff_t stride, int columns, size_t count, uint8_t* to) {
  if (stride == 1 && columns == 1) {
    std::memcpy(to, from, count);
    return;
  }
  if (stride != 1 && stride != 2 && stride != 4) {
    for (size_t p = 0; p < count; ++p)
      to[p] = from[static_cast<ptrdiff_t>(p / static_cast<size_t>(columns)) * stride];
    return;
  }
  const size_t whole = count / static_cast<size_t>(columns);
  HWY_DYNAMIC_DISPATCH(spread_row)
  (from, static_cast<size_t>(stride), static_cast<size_t>(columns), whole, to);
  // The last pixel of an odd row.
  if (columns == 2 && count % 2 == 1) to[count - 1] = from[static_cast<ptrdiff_t>(whole) * stride];
}

void mean_of_pairs(const uint8_t* above, const uint8_t* below, size_t count, uint8_t* out) {
  const size_t pairs = count / 2;
  const uint8_t* second = below ? below : above;
  for (size_t k = HWY_DYNAMIC_DISPATCH(mean_row)(above, below, pairs, out); k < pairs; ++k)
    out[k] = static_cast<uint8_t>(
        (above[2 * k] + above[2 * k + 1] + second[2 * k] + second[2 * k + 1] + 2) / 4);
  if (count % 2 == 1)
    out[pairs] = static_cast<uint8_t>((above[count - 1] + second[count - 1] + 1) / 2);
}

void interleave(const uint8_t* first, const uint8_t* second, size_t count, uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(interleave_row)(first, second, count, out);
}

void fit_levels(const uint8_t* x, uint8_t black, uint8_t white, size_t count, uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(fit_row)(x, black, white, count, out);
}

void residual_levels(const uint8_t* x, const uint8_t* l, uint8_t black, uint8_t white, size_t count,
                     uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(residual_row)(x, l, black, white, count, out);
}

bool are_all(const uint8_t* samples, uint8_t value, size_t count) {
  return HWY_DYNAMIC_DISPATCH(all_row)(samples, value, count);
}

}  // namespace qdmd
#endif
