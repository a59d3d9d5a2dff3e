// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/mean_distance.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/mean_distance.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Each does, from pixel p on, as many as fill whole vectors, and returns the first that is left.

template <class D16>
HWY_INLINE size_t raise_some(D16 d16, const uint16_t* HWY_RESTRICT mean, int factor, size_t p,
                             size_t count, uint8_t* HWY_RESTRICT limit) {
  const hn::Rebind<uint8_t, D16> d8;
  const auto by = hn::Set(d16, static_cast<uint16_t>(factor)), most = hn::Set(d16, 255);
  for (; p + hn::Lanes(d16) <= count; p += hn::Lanes(d16)) {
    const auto own = hn::Min(hn::MulHigh(hn::LoadU(d16, mean + p), by), most);
    const auto larger = hn::Max(own, hn::PromoteTo(d16, hn::LoadU(d8, limit + p)));
    // Up to 255, as signed numbers, too.
    hn::StoreU(hn::DemoteTo(d8, hn::BitCast(hn::RebindToSigned<D16>(), larger)), d8, limit + p);
  }
  return p;
}

template <class D16>
HWY_INLINE size_t keep_some(D16 d16, const uint16_t* HWY_RESTRICT squared,
                            const uint8_t* HWY_RESTRICT limit, size_t p, size_t count,
                            uint8_t* HWY_RESTRICT mask) {
  const hn::Rebind<uint8_t, D16> d8;
  const hn::RebindToSigned<D16> d16s;
  for (; p + hn::Lanes(d16) <= count; p += hn::Lanes(d16)) {
    const auto most = hn::PromoteTo(d16, hn::LoadU(d8, limit + p));
    const auto beyond = hn::Gt(hn::LoadU(d16, squared + p), hn::Mul(most, most));
    const auto kept = hn::IfThenElseZero(beyond, hn::PromoteTo(d16, hn::LoadU(d8, mask + p)));
    hn::StoreU(hn::DemoteTo(d8, hn::BitCast(d16s, kept)), d8, mask + p);
  }
  return p;
}

struct Rows {
  const uint16_t* squared;
  const uint8_t *limit, *near, *now, *before;
};

template <class DF>
HWY_INLINE size_t learn_some(DF df, const Rows& rows, const NoiseRates& rates, size_t p,
                             size_t count, uint16_t* HWY_RESTRICT mean) {
  const hn::RebindToSigned<DF> d32;
  const hn::Rebind<uint8_t, DF> d8;
  const hn::Rebind<uint16_t, DF> d16;
  const auto zero = hn::Zero(d32), byte = hn::Set(d32, 255);
  const auto factor = hn::Set(d32, rates.factor), moments = hn::Set(d32, rates.most_of_moments);
  const auto share = hn::Set(df, rates.share), rare = hn::Set(df, rates.share_of_moments);
  const auto load = [&](const uint8_t* from)
                        HWY_ATTR { return hn::PromoteTo(d32, hn::LoadU(d8, from + p)); };
  for (; p + hn::Lanes(df) <= count; p += hn::Lanes(df)) {
    const auto known = hn::PromoteTo(d32, hn::LoadU(d16, mean + p)),
               own = hn::PromoteTo(d32, hn::LoadU(d16, rows.squared + p));
    const auto raised = hn::Min(hn::ShiftRight<16>(hn::Mul(known, factor)), byte);
    const auto most = hn::Max(raised, load(rows.limit));
    const auto far = hn::Min(hn::ShiftRight<8>(hn::Mul(most, moments)), byte);
    const auto calm =
        hn::And(hn::Eq(load(rows.near), zero), hn::Not(hn::Gt(own, hn::Mul(most, most))));
    const auto moment = hn::And(hn::Ne(load(rows.now), zero), hn::Eq(load(rows.before), zero));
    const auto counts = hn::IfThenElse(calm, own, hn::Min(own, hn::Mul(far, far)));
    const auto level = hn::Min(hn::Sqrt(hn::ConvertTo(df, counts)), hn::Set(df, kMostMeanDistance));
    const auto by = hn::IfThenElse(hn::RebindMask(df, calm), share,
                                   hn::IfThenElseZero(hn::RebindMask(df, moment), rare));
    const auto from = hn::ConvertTo(df, known);
    const auto step = hn::Mul(by, hn::Sub(hn::Mul(hn::Set(df, 256.0f), level), from));
    const auto next = hn::Add(hn::Add(from, step), hn::Set(df, 0.5f));
    hn::StoreU(hn::DemoteTo(d16, hn::ConvertTo(d32, next)), d16, mean + p);
  }
  return p;
}

}  // namespace

void raise(const uint16_t* mean, int factor, size_t count, uint8_t* limit) {
  const size_t p = raise_some(hn::ScalableTag<uint16_t>(), mean, factor, 0, count, limit);
  raise_some(hn::CappedTag<uint16_t, 1>(), mean, factor, p, count, limit);
}

void keep(const uint16_t* squared, const uint8_t* limit, size_t count, uint8_t* mask) {
  const size_t p = keep_some(hn::ScalableTag<uint16_t>(), squared, limit, 0, count, mask);
  keep_some(hn::CappedTag<uint16_t, 1>(), squared, limit, p, count, mask);
}

void learn_of_noise(const uint16_t* squared, const uint8_t* limit, const uint8_t* near,
                    const uint8_t* now, const uint8_t* before, const NoiseRates& rates,
                    size_t count, uint16_t* mean) {
  const Rows rows = {squared, limit, near, now, before};
  const size_t p = learn_some(hn::ScalableTag<float>(), rows, rates, 0, count, mean);
  learn_some(hn::CappedTag<float, 1>(), rows, rates, p, count, mean);
}

// A plain loop, which the compiler makes vectors of for each instruction set.
void learn(const uint16_t* HWY_RESTRICT squared, size_t count, float share,
           uint16_t* HWY_RESTRICT mean) {
  for (size_t p = 0; p < count; ++p) {
    const float distance = std::sqrt(static_cast<float>(squared[p]));
    const float level = distance < kMostMeanDistance ? distance : kMostMeanDistance;
    const auto known = static_cast<float>(mean[p]);
    mean[p] = static_cast<uint16_t>(static_cast<int>(known + share * (256 * level - known) + 0.5f));
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(learn);
HWY_EXPORT(raise);
HWY_EXPORT(keep);
HWY_EXPORT(learn_of_noise);

void learn_distance(const uint16_t* squared, size_t count, float share, uint16_t* mean) {
  HWY_DYNAMIC_DISPATCH(learn)(squared, count, share, mean);
}

void raise_limit(const uint16_t* mean, int factor, size_t count, uint8_t* limit) {
  HWY_DYNAMIC_DISPATCH(raise)(mean, factor, count, limit);
}

void keep_beyond(const uint16_t* squared, const uint8_t* limit, size_t count, uint8_t* mask) {
  HWY_DYNAMIC_DISPATCH(keep)(squared, limit, count, mask);
}

void learn_noise(const uint16_t* squared, const uint8_t* limit, const uint8_t* near,
                 const uint8_t* now, const uint8_t* before, const NoiseRates& rates, size_t count,
                 uint16_t* mean) {
  HWY_DYNAMIC_DISPATCH(learn_of_noise)
  (squared, limit, near, now, before, rates, count, mean);
}

}  // namespace qdmd
#endif
