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

// A plain loop, which the compiler makes vectors of for each instruction set.
void norm_row(const uint8_t* HWY_RESTRICT xr, const uint8_t* HWY_RESTRICT xg,
              const uint8_t* HWY_RESTRICT xb, const uint8_t* HWY_RESTRICT lr,
              const uint8_t* HWY_RESTRICT lg, const uint8_t* HWY_RESTRICT lb, size_t count,
              uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i) {
    const int r = xr[i] - lr[i], g = xg[i] - lg[i], b = xb[i] - lb[i];
    const float norm = std::sqrt(static_cast<float>(r * r + g * g + b * b));
    out[i] = static_cast<uint8_t>(static_cast<int>(norm < 255.0f ? norm : 255.0f));
  }
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
HWY_EXPORT(norm_row);

}  // namespace

void absolute_residual(const uint8_t* x, const uint8_t* l, size_t count, uint8_t* out) {
  for (size_t p = HWY_DYNAMIC_DISPATCH(differ)(x, l, count, out); p < count; ++p)
    out[p] = static_cast<uint8_t>(std::abs(x[p] - l[p]));
}

void residual_norm(const uint8_t* const x[3], const uint8_t* const l[3], size_t count,
                   uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(norm_row)(x[0], x[1], x[2], l[0], l[1], l[2], count, out);
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
