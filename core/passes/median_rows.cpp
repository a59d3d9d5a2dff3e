// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/median_rows.h"

#include <algorithm>
#include <cstring>

#include "core/passes/median_network.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/median_rows.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void middle(const MedianNetwork<kMedianRows>& network, const float* const* rows,
            const float* divisors, size_t count, size_t width, float* median) {
  const hn::CappedTag<float, 16> d;
  const size_t lanes = hn::Lanes(d);
  HWY_ALIGN float levels[kMedianRows][16], last[16];
  for (size_t first = 0; first < width; first += lanes) {
    const size_t used = std::min(lanes, width - first);
    for (size_t i = 0; i < count; ++i) {
      const float* from = rows[i] + first;
      if (used < lanes) {
        std::copy_n(from, used, last);
        std::fill(last + used, last + lanes, 0.0f);
        from = last;
      }
      auto level = hn::LoadU(d, from);
      if (divisors[i] != 1) level = hn::Div(level, hn::Set(d, divisors[i]));
      hn::Store(level, d, levels[i]);
    }
    for (const auto& [smaller, larger] : network) {
      const auto a = hn::Load(d, levels[smaller]), b = hn::Load(d, levels[larger]);
      hn::Store(hn::Min(a, b), d, levels[smaller]);
      hn::Store(hn::Max(a, b), d, levels[larger]);
    }
    std::copy_n(levels[network.upper_middle()], used, median + first);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(middle);

}  // namespace

void median_rows(const float* const* rows, const float* divisors, size_t count, size_t width,
                 float* median) {
  const MedianNetwork<kMedianRows> network(count);
  HWY_DYNAMIC_DISPATCH(middle)(network, rows, divisors, count, width, median);
}

}  // namespace qdmd
#endif
