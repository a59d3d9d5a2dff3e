#include "core/passes/residual.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/residual.cpp"
#include "core/passes/simd.h"

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

// Not a plain loop: compilers make no vectors of std::sqrt, which may set errno. Roots are rounded
// correctly on every instruction set, and none of an integer up to 65535 is rounded up to the next.
size_t norm(const uint8_t* const* x, const uint8_t* const* l, size_t count, float steps,
            uint8_t* out) {
  const hn::ScalableTag<float> d;
  const hn::Rebind<int32_t, decltype(d)> d32;
  const hn::Rebind<uint16_t, decltype(d)> d16;
  const hn::Rebind<uint8_t, decltype(d)> d8;
  const hn::RebindToUnsigned<decltype(d32)> d32u;
  const auto factor = hn::Set(d, steps), most = hn::Set(d, 255.0f);
  // Known not to change with what is written.
  const uint8_t *xr = x[0], *xg = x[1], *xb = x[2], *lr = l[0], *lg = l[1], *lb = l[2];
  const auto square = [&](const uint8_t* of_x, const uint8_t* of_l) HWY_ATTR {
    const auto a = hn::LoadU(d8, of_x), b = hn::LoadU(d8, of_l);
    const auto distance =
        hn::PromoteTo(d16, hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)));
    return hn::Mul(distance, distance);
  };
  size_t p = 0;
  for (; p + hn::Lanes(d) <= count; p += hn::Lanes(d)) {
    // Saturated sums have a norm of 255 like all above.
    const auto sum = hn::SaturatedAdd(
        hn::SaturatedAdd(square(xr + p, lr + p), square(xg + p, lg + p)), square(xb + p, lb + p));
    const auto level = hn::Mul(factor, hn::Sqrt(hn::ConvertTo(d, hn::PromoteTo(d32, sum))));
    const auto whole = hn::ConvertTo(d32, hn::Min(level, most));
    hn::StoreU(hn::TruncateTo(d8, hn::BitCast(d32u, whole)), d8, out + p);
  }
  return p;
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

}  // namespace

void absolute_residual(const uint8_t* x, const uint8_t* l, size_t count, uint8_t* out) {
  for (size_t p = HWY_DYNAMIC_DISPATCH(differ)(x, l, count, out); p < count; ++p)
    out[p] = static_cast<uint8_t>(std::abs(x[p] - l[p]));
}

void residual_norm(const uint8_t* const x[3], const uint8_t* const l[3], size_t count, uint8_t* out,
                   int steps) {
  const auto factor = static_cast<float>(steps);
  for (size_t p = HWY_DYNAMIC_DISPATCH(norm)(x, l, count, factor, out); p < count; ++p) {
    int sum = 0;
    for (int c = 0; c < 3; ++c) sum += (x[c][p] - l[c][p]) * (x[c][p] - l[c][p]);
    const float level = factor * std::sqrt(static_cast<float>(sum));
    out[p] = static_cast<uint8_t>(static_cast<int>(std::min(level, 255.0f)));
  }
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
