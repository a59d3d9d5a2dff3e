// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/gram/block_sums.h"

// As for the passes.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/gram/block_sums.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR
size_t sum_pairs(const uint8_t*, const uint8_t*, size_t, uint8_t*, uint8_t*) { return 0; }
#else
// Adds up whole pairs. Returns how many were done.
size_t sum_pairs(const uint8_t* above, const uint8_t* below, size_t pairs, uint8_t* high,
                 uint8_t* low) {
  const hn::ScalableTag<uint8_t> d;
  const hn::Repartition<uint16_t, decltype(d)> d16;
  const hn::RebindToSigned<decltype(d16)> d16s;
  const hn::Half<decltype(d)> half;
  const auto byte = hn::Set(d16, 0x00FF), digit = hn::Set(d16, 3);
  const auto pairs_of = [&](const uint8_t* from) HWY_ATTR {
    const auto both = hn::BitCast(d16, hn::LoadU(d, from));
    return hn::Add(hn::And(both, byte), hn::ShiftRight<8>(both));
  };
  size_t k = 0;
  for (; k + hn::Lanes(d16) <= pairs; k += hn::Lanes(d16)) {
    auto sum = pairs_of(above + 2 * k);
    if (below) sum = hn::Add(sum, pairs_of(below + 2 * k));
    hn::StoreU(hn::DemoteTo(half, hn::BitCast(d16s, hn::ShiftRight<2>(sum))), half, high + k);
    hn::StoreU(hn::DemoteTo(half, hn::BitCast(d16s, hn::And(sum, digit))), half, low + k);
  }
  return k;
}
#endif

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(sum_pairs);

void block_sums(const uint8_t* above, const uint8_t* below, size_t count, uint8_t* high,
                uint8_t* low) {
  size_t k = HWY_DYNAMIC_DISPATCH(sum_pairs)(above, below, count / 2, high, low);
  for (; k < (count + 1) / 2; ++k) {
    int sum = 0;
    for (size_t p = 2 * k; p < 2 * k + 2 && p < count; ++p)
      sum += above[p] + (below ? below[p] : 0);
    high[k] = static_cast<uint8_t>(sum / 4);
    low[k] = static_cast<uint8_t>(sum % 4);
  }
}

}  // namespace qdmd
#endif
