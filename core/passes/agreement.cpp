// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/agreement.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/agreement.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

Agreement agreement(const float* const a[3], const float* const b[3], size_t cells,
                    const float gain[3], float end, float most) {
  const hn::CappedTag<float, 16> d;
  const size_t lanes = hn::Lanes(d);
  const auto ends = hn::Set(d, end), limit = hn::Set(d, most);
  const auto gain_0 = hn::Set(d, gain[0]), gain_1 = hn::Set(d, gain[1]),
             gain_2 = hn::Set(d, gain[2]);
  const float *a_0 = a[0], *a_1 = a[1], *a_2 = a[2], *b_0 = b[0], *b_1 = b[1], *b_2 = b[2];
  Agreement found;
  const auto see = [&](auto x_0, auto y_0, auto x_1, auto y_1, auto x_2, auto y_2) HWY_ATTR {
    const auto says_0 = hn::Lt(hn::Max(x_0, y_0), ends), says_1 = hn::Lt(hn::Max(x_1, y_1), ends),
               says_2 = hn::Lt(hn::Max(x_2, y_2), ends);
    auto apart = hn::IfThenElseZero(says_0, hn::Abs(hn::Sub(hn::Div(x_0, gain_0), y_0)));
    apart = hn::Add(apart, hn::IfThenElseZero(says_1, hn::Abs(hn::Sub(hn::Div(x_1, gain_1), y_1))));
    apart = hn::Add(apart, hn::IfThenElseZero(says_2, hn::Abs(hn::Sub(hn::Div(x_2, gain_2), y_2))));
    const auto known = hn::Or(hn::Or(says_0, says_1), says_2);
    found.seen += hn::CountTrue(d, known);
    found.agree += hn::CountTrue(d, hn::And(known, hn::Lt(apart, limit)));
  };
  size_t at = 0;
  for (; at + lanes <= cells; at += lanes)
    see(hn::LoadU(d, a_0 + at), hn::LoadU(d, b_0 + at), hn::LoadU(d, a_1 + at),
        hn::LoadU(d, b_1 + at), hn::LoadU(d, a_2 + at), hn::LoadU(d, b_2 + at));
  if (at == cells) return found;
  // What is no cell is at the end.
  HWY_ALIGN float rest[6][16];
  const float* const from[6] = {a_0, b_0, a_1, b_1, a_2, b_2};
  for (size_t i = 0; i < 6; ++i)
    std::fill_n(std::copy_n(from[i] + at, cells - at, rest[i]), lanes - (cells - at), end);
  see(hn::Load(d, rest[0]), hn::Load(d, rest[1]), hn::Load(d, rest[2]), hn::Load(d, rest[3]),
      hn::Load(d, rest[4]), hn::Load(d, rest[5]));
  return found;
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(agreement);

}  // namespace

Agreement find_agreement(const float* const a[3], const float* const b[3], size_t cells,
                         const float gain[3], float end, float most) {
  return HWY_DYNAMIC_DISPATCH(agreement)(a, b, cells, gain, end, most);
}

}  // namespace qdmd
#endif
