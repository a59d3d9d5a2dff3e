// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/residual.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/residual.cpp"
#include "core/passes/simd.h"
// After simd.h.
#include "core/passes/even_odd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Each function returns how many samples it did: as many as fill whole vectors.

size_t differ(const uint8_t* x, const uint8_t* l, size_t count, uint8_t* out) {
  const hn::ScalableTag<uint8_t> d;
  size_t p = 0;
  for (; p + hn::Lanes(d) <= count; p += hn::Lanes(d)) {
    const auto a = hn::LoadU(d, x + p), b = hn::LoadU(d, l + p);
    hn::StoreU(hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)), d, out + p);
  }
  return p;
}

// White where the squared norm exceeds `limit` and the square of the pixel's own; sums saturate, so
// `limit` is below 65535.
template <bool kOwnLimits>
HWY_INLINE size_t exceed_limits(const uint8_t* const* x, const uint8_t* const* l, size_t count,
                                uint16_t limit, const uint8_t* limits, uint8_t* out) {
  const hn::ScalableTag<uint16_t> d16;
  const hn::RebindToSigned<decltype(d16)> d16s;
  const hn::Rebind<uint8_t, decltype(d16)> d8;
  const auto largest = hn::Set(d16, limit);
  const auto square = [&](size_t c, size_t p) HWY_ATTR {
    const auto a = hn::LoadU(d8, x[c] + p), b = hn::LoadU(d8, l[c] + p);
    const auto distance =
        hn::PromoteTo(d16, hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)));
    return hn::Mul(distance, distance);
  };
  size_t p = 0;
  for (; p + hn::Lanes(d16) <= count; p += hn::Lanes(d16)) {
    const auto sum = hn::SaturatedAdd(hn::SaturatedAdd(square(0, p), square(1, p)), square(2, p));
    auto least = largest;
    if constexpr (kOwnLimits) {
      const auto own = hn::PromoteTo(d16, hn::LoadU(d8, limits + p));
      least = hn::Max(least, hn::Mul(own, own));
    }
    // 0xFFFF to 0x00FF: the samples' 255.
    const auto white = hn::ShiftRight<8>(hn::VecFromMask(d16, hn::Gt(sum, least)));
    hn::StoreU(hn::DemoteTo(d8, hn::BitCast(d16s, white)), d8, out + p);
  }
  return p;
}

size_t exceed(const uint8_t* const* x, const uint8_t* const* l, size_t count, uint16_t limit,
              const uint8_t* limits, uint8_t* out) {
  return limits ? exceed_limits<true>(x, l, count, limit, limits, out)
                : exceed_limits<false>(x, l, count, limit, nullptr, out);
}

#if HWY_TARGET == HWY_SCALAR
size_t norm(const uint8_t* const*, const uint8_t* const*, size_t, uint8_t*) { return 0; }
size_t norm_in_quarters(const uint8_t* const*, const uint8_t* const*, size_t, uint8_t*) {
  return 0;
}
#else
// floor(sqrt(x)). Roots are rounded correctly on every instruction set, and none of an integer up
// to 65535 is rounded up to the next. Not a plain loop: compilers make no vectors of std::sqrt,
// which may set errno.
HWY_INLINE EvenOdd::V16 root(EvenOdd::V16 x) {
  const EvenOdd::Words d16;
  const hn::Repartition<float, decltype(d16)> d;
  const hn::Repartition<uint32_t, decltype(d16)> d32;
  const hn::Repartition<int32_t, decltype(d16)> d32s;
  const auto whole = [&](hn::Vec<decltype(d32)> square) HWY_ATTR {
    const auto level = hn::Sqrt(hn::ConvertTo(d, hn::BitCast(d32s, square)));
    return hn::BitCast(d32, hn::ConvertTo(d32s, level));
  };
  const auto pairs = hn::BitCast(d32, x);
  const auto low = whole(hn::And(pairs, hn::Set(d32, uint32_t{65535})));
  const auto high = whole(hn::ShiftRight<16>(pairs));
  return hn::BitCast(d16, hn::Or(low, hn::ShiftLeft<16>(high)));
}

// 2^kBits steps to a level, of fewer pixels than a vector of bytes has.
template <int kBits>
HWY_INLINE size_t few_norms(const uint8_t* const* x, const uint8_t* const* l, size_t count,
                            uint8_t* out) {
  const hn::ScalableTag<float> d;
  const hn::Rebind<int32_t, decltype(d)> d32;
  const hn::Rebind<uint8_t, decltype(d)> d8;
  const auto square = [&](const uint8_t* of_x, const uint8_t* of_l) HWY_ATTR {
    const auto distance =
        hn::Sub(hn::PromoteTo(d32, hn::LoadU(d8, of_x)), hn::PromoteTo(d32, hn::LoadU(d8, of_l)));
    return hn::Mul(distance, distance);
  };
  const auto steps = hn::Set(d, static_cast<float>(1 << kBits)), most = hn::Set(d, 255.0f);
  size_t p = 0;
  for (; p + hn::Lanes(d) <= count; p += hn::Lanes(d)) {
    const auto sum = hn::Add(hn::Add(square(x[0] + p, l[0] + p), square(x[1] + p, l[1] + p)),
                             square(x[2] + p, l[2] + p));
    const auto level = hn::Min(hn::Mul(steps, hn::Sqrt(hn::ConvertTo(d, sum))), most);
    hn::StoreU(hn::DemoteTo(d8, hn::ConvertTo(d32, level)), d8, out + p);
  }
  return p;
}

// 2^kBits steps to a level.
template <int kBits>
HWY_INLINE size_t norms(const uint8_t* const* x, const uint8_t* const* l, size_t count,
                        uint8_t* out) {
  const EvenOdd::Bytes d;
  const EvenOdd::Words d16;
  // Known not to change with what is written.
  const uint8_t *xr = x[0], *xg = x[1], *xb = x[2], *lr = l[0], *lg = l[1], *lb = l[2];
  const auto distance = [&](const uint8_t* of_x, const uint8_t* of_l) HWY_ATTR {
    const auto a = hn::LoadU(d, of_x), b = hn::LoadU(d, of_l);
    return hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a));
  };
  const auto norm = [&](EvenOdd::V16 r, EvenOdd::V16 g, EvenOdd::V16 b) HWY_ATTR {
    // Saturated sums have a norm of 255 like all above.
    auto sum = hn::SaturatedAdd(hn::SaturatedAdd(hn::Mul(r, r), hn::Mul(g, g)), hn::Mul(b, b));
    if constexpr (kBits > 0)
      sum = hn::ShiftLeft<2 * kBits>(
          hn::Min(sum, hn::Set(d16, static_cast<uint16_t>(65535 >> 2 * kBits))));
    return root(sum);
  };
  const size_t lanes = hn::Lanes(d);
  if (count < lanes) return few_norms<kBits>(x, l, count, out);
  for (size_t p = 0; p < count; p += lanes) {
    // The last ones once more.
    p = std::min(p, count - lanes);
    const auto r = distance(xr + p, lr + p), g = distance(xg + p, lg + p),
               b = distance(xb + p, lb + p);
    hn::StoreU(EvenOdd::joined(norm(EvenOdd::even(r), EvenOdd::even(g), EvenOdd::even(b)),
                               norm(EvenOdd::odd(r), EvenOdd::odd(g), EvenOdd::odd(b))),
               d, out + p);
  }
  return count;
}

size_t norm(const uint8_t* const* x, const uint8_t* const* l, size_t count, uint8_t* out) {
  return norms<0>(x, l, count, out);
}
size_t norm_in_quarters(const uint8_t* const* x, const uint8_t* const* l, size_t count,
                        uint8_t* out) {
  return norms<2>(x, l, count, out);
}
#endif

// From pixel p on, as many as fill whole vectors; returns the first that is left.
template <class D>
HWY_INLINE size_t some_steps(D d, const uint8_t* const* x, const uint8_t* const* l, size_t p,
                             size_t count, const uint8_t* limits, uint16_t* out) {
  const hn::Rebind<int32_t, D> d32;
  const hn::Rebind<uint16_t, D> d16;
  const hn::Rebind<uint8_t, D> d8;
  const auto load = [&](const uint8_t* from)
                        HWY_ATTR { return hn::PromoteTo(d32, hn::LoadU(d8, from)); };
  for (; p + hn::Lanes(d) <= count; p += hn::Lanes(d)) {
    auto squared = hn::Zero(d32);
    for (size_t c = 0; c < 3; ++c) {
      const auto distance = hn::Sub(load(x[c] + p), load(l[c] + p));
      squared = hn::Add(squared, hn::Mul(distance, distance));
    }
    const auto limit = limits ? load(limits + p) : hn::Zero(d32);
    const auto beyond = hn::VecFromMask(d32, hn::Gt(squared, hn::Mul(limit, limit)));
    // None of an integer up to 3 x 255^2 is rounded up to the next step.
    const auto steps = hn::Mul(hn::Sqrt(hn::ConvertTo(d, squared)),
                               hn::Set(d, static_cast<float>(kResidualSteps)));
    const auto more = hn::And(beyond, hn::Set(d32, kResidualBeyond));
    hn::StoreU(hn::DemoteTo(d16, hn::Add(hn::ConvertTo(d32, steps), more)), d16, out + p);
  }
  return p;
}

void steps(const uint8_t* const* x, const uint8_t* const* l, size_t count, const uint8_t* limits,
           uint16_t* out) {
  const size_t p = some_steps(hn::ScalableTag<float>(), x, l, 0, count, limits, out);
  some_steps(hn::CappedTag<float, 1>(), x, l, p, count, limits, out);
}

size_t mask_samples(const uint8_t* x, const uint8_t* mask, size_t count, uint8_t* out) {
  const hn::ScalableTag<uint8_t> d;
  size_t p = 0;
  for (; p + hn::Lanes(d) <= count; p += hn::Lanes(d))
    hn::StoreU(hn::And(hn::LoadU(d, x + p), hn::LoadU(d, mask + p)), d, out + p);
  return p;
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(differ);
HWY_EXPORT(exceed);
HWY_EXPORT(mask_samples);
HWY_EXPORT(norm);
HWY_EXPORT(norm_in_quarters);
HWY_EXPORT(steps);

}  // namespace

void absolute_residual(const uint8_t* x, const uint8_t* l, size_t count, uint8_t* out) {
  for (size_t p = HWY_DYNAMIC_DISPATCH(differ)(x, l, count, out); p < count; ++p)
    out[p] = static_cast<uint8_t>(std::abs(x[p] - l[p]));
}

void residual_norm(const uint8_t* const x[3], const uint8_t* const l[3], size_t count, uint8_t* out,
                   int steps) {
  size_t p = steps == 1 ? HWY_DYNAMIC_DISPATCH(norm)(x, l, count, out)
                        : HWY_DYNAMIC_DISPATCH(norm_in_quarters)(x, l, count, out);
  for (; p < count; ++p) {
    int sum = 0;
    for (int c = 0; c < 3; ++c) sum += (x[c][p] - l[c][p]) * (x[c][p] - l[c][p]);
    const float level = static_cast<float>(steps) * std::sqrt(static_cast<float>(sum));
    out[p] = static_cast<uint8_t>(static_cast<int>(std::min(level, 255.0f)));
  }
}

void residual_steps(const uint8_t* const x[3], const uint8_t* const l[3], size_t count,
                    const uint8_t* limits, uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(steps)(x, l, count, limits, out);
}

void foreground_mask(const uint8_t* const x[3], const uint8_t* const l[3], size_t count,
                     double threshold, const uint8_t* limits, uint8_t* out) {
  // Squared norms are integers.
  const auto limit = static_cast<int>(std::min(std::floor(threshold * threshold), 1e6));
  size_t p = 0;
  if (limit < 65535)
    p = HWY_DYNAMIC_DISPATCH(exceed)(x, l, count, static_cast<uint16_t>(limit), limits, out);
  for (; p < count; ++p) {
    int sum = 0;
    for (int c = 0; c < 3; ++c) sum += (x[c][p] - l[c][p]) * (x[c][p] - l[c][p]);
    out[p] = sum > limit && (!limits || sum > limits[p] * limits[p]) ? 255 : 0;
  }
}

void apply_mask(const uint8_t* x, const uint8_t* mask, size_t count, uint8_t* out) {
  for (size_t p = HWY_DYNAMIC_DISPATCH(mask_samples)(x, mask, count, out); p < count; ++p)
    out[p] = x[p] & mask[p];
}

}  // namespace qdmd
#endif
