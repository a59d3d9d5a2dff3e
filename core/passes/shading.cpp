// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/shading.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/shading.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Columns of a whole run and of what is around it: whole vectors of each instruction set.
constexpr size_t kWhole = kShadingRun + 2 * kShadingReach;
using F32 = hn::CappedTag<float, 16>;
using I32 = hn::RebindToSigned<F32>;
using U8 = hn::Rebind<uint8_t, F32>;
static_assert(kWhole % hn::MaxLanes(F32()) == 0);

HWY_INLINE hn::Vec<I32> load(const uint8_t* from) {
  return hn::PromoteTo(I32(), hn::LoadU(U8(), from));
}

HWY_INLINE hn::Vec<F32> load_float(const uint8_t* from, hn::Vec<I32> black) {
  return hn::ConvertTo(F32(), hn::Sub(load(from), black));
}

// A whole run and what is around it: where that begins.
struct Whole {
  ShadingRows rows;
  alignas(64) uint8_t limit[kWhole], asked[kWhole];

  const uint8_t* x(size_t channel, size_t row) const { return rows.x[channel] + row * rows.x_step; }
  const uint8_t* l(size_t channel, size_t row) const { return rows.l[channel] + row * rows.l_step; }
  const uint8_t* differing(size_t row) const { return rows.differing + row * rows.l_step; }
};

// Looks at pixels alone. Returns whether any is shaded.
HWY_INLINE bool shaded_alone(const Whole& whole, const uint8_t* black, const LightRange& range,
                             uint8_t* HWY_RESTRICT out) {
  const F32 df;
  const auto dark_red = hn::Set(I32(), black[0]), dark_green = hn::Set(I32(), black[1]),
             dark_blue = hn::Set(I32(), black[2]);
  const auto darkest = hn::Set(df, range.darkest), brightest = hn::Set(df, range.brightest),
             share = hn::Set(df, range.alone), least = hn::Set(df, range.least_rest),
             of_level = hn::Set(df, range.of_level * range.of_level);
  bool any = false;
  for (size_t p = 0; p < kWhole; p += hn::Lanes(df)) {
    const auto r = load_float(whole.x(0, kShadingReach) + p, dark_red),
               g = load_float(whole.x(1, kShadingReach) + p, dark_green),
               b = load_float(whole.x(2, kShadingReach) + p, dark_blue);
    const auto lit_r = load_float(whole.l(0, kShadingReach) + p, dark_red),
               lit_g = load_float(whole.l(1, kShadingReach) + p, dark_green),
               lit_b = load_float(whole.l(2, kShadingReach) + p, dark_blue);
    // Whole numbers below 2^24.
    const auto xl = hn::Add(hn::Add(hn::Mul(r, lit_r), hn::Mul(g, lit_g)), hn::Mul(b, lit_b));
    const auto ll =
        hn::Add(hn::Add(hn::Mul(lit_r, lit_r), hn::Mul(lit_g, lit_g)), hn::Mul(lit_b, lit_b));
    // |rest| |L| is the length of the vector part of conj(x) L.
    const auto i = hn::Sub(hn::Mul(g, lit_b), hn::Mul(b, lit_g)),
               j = hn::Sub(hn::Mul(b, lit_r), hn::Mul(r, lit_b)),
               k = hn::Sub(hn::Mul(r, lit_g), hn::Mul(g, lit_r));
    const auto rest = hn::Add(hn::Add(hn::Mul(i, i), hn::Mul(j, j)), hn::Mul(k, k));
    const auto limit = hn::ConvertTo(df, load(whole.limit + p));
    const auto own = hn::Max(least, hn::Mul(share, limit));
    const auto most = hn::Min(hn::Mul(own, own), hn::Mul(of_level, ll));
    const auto lit = hn::And(hn::And(hn::Gt(ll, hn::Zero(df)), hn::Ge(xl, hn::Mul(darkest, ll))),
                             hn::Le(xl, hn::Mul(brightest, ll)));
    const auto shaded = hn::And(lit, hn::Le(rest, hn::Mul(most, ll)));
    const auto chosen =
        hn::And(hn::VecFromMask(I32(), hn::RebindMask(I32(), shaded)), load(whole.asked + p));
    any |= !hn::AllFalse(I32(), hn::Ne(chosen, hn::Zero(I32())));
    hn::StoreU(hn::DemoteTo(U8(), chosen), U8(), out + p);
  }
  return any;
}

// <x, L>, <L, L>, <x, x> and the number of pixels that differ in columns: whole numbers, which
// floats hold in any order.
struct Products {
  static constexpr size_t kPadded = kWhole + 2 * kShadingReach;
  alignas(64) float xl[kPadded], ll[kPadded], xx[kPadded], count[kPadded];
};

HWY_INLINE void add_columns(const Whole& whole, const uint8_t* black,
                            Products* HWY_RESTRICT columns) {
  const F32 df;
  const hn::Vec<I32> dark[3] = {hn::Set(I32(), black[0]), hn::Set(I32(), black[1]),
                                hn::Set(I32(), black[2])};
  for (size_t p = 0; p < kWhole; p += hn::Lanes(df)) {
    auto xl = hn::Zero(df), ll = xl, xx = xl, count = xl;
    for (size_t row = 0; row < kShadingAlong; ++row) {
      auto own_xl = hn::Zero(df), own_ll = own_xl, own_xx = own_xl;
      for (size_t c = 0; c < 3; ++c) {
        const auto x = load_float(whole.x(c, row) + p, dark[c]),
                   l = load_float(whole.l(c, row) + p, dark[c]);
        own_xl = hn::MulAdd(x, l, own_xl);
        own_ll = hn::MulAdd(l, l, own_ll);
        own_xx = hn::MulAdd(x, x, own_xx);
      }
      const auto differs =
          hn::RebindMask(df, hn::Ne(load(whole.differing(row) + p), hn::Zero(I32())));
      xl = hn::Add(xl, hn::IfThenElseZero(differs, own_xl));
      ll = hn::Add(ll, hn::IfThenElseZero(differs, own_ll));
      xx = hn::Add(xx, hn::IfThenElseZero(differs, own_xx));
      count = hn::Add(count, hn::IfThenElseZero(differs, hn::Set(df, 1.0f)));
    }
    hn::StoreU(xl, df, columns->xl + p), hn::StoreU(ll, df, columns->ll + p);
    hn::StoreU(xx, df, columns->xx + p), hn::StoreU(count, df, columns->count + p);
  }
}

HWY_INLINE hn::Vec<F32> around(const float* column) {
  auto sum = hn::LoadU(F32(), column);
  for (size_t i = 1; i < kShadingAlong; ++i) sum = hn::Add(sum, hn::LoadU(F32(), column + i));
  return sum;
}

// Takes out of `out` where the pixels around that differ have another texture. Sums of 25 products
// are below 2^23, which floats hold; the products of two such sums lose less than 0.02 squared
// levels. Column p of what is around is kShadingReach to the left of out[p].
HWY_INLINE void alike_around(const Whole& whole, const uint8_t* black, const LightRange& range,
                             uint8_t* HWY_RESTRICT out) {
  const F32 df;
  Products columns;
  add_columns(whole, black, &columns);
  // Read, but for no pixel of the run.
  for (size_t p = kWhole; p < Products::kPadded; ++p)
    columns.xl[p] = columns.ll[p] = columns.xx[p] = columns.count[p] = 0;
  alignas(64) uint8_t limit[kWhole] = {};
  std::copy_n(whole.limit + kShadingReach, kShadingRun, limit);
  const auto share = hn::Set(df, range.around), least = hn::Set(df, range.least_rest);
  for (size_t p = 0; p < kWhole; p += hn::Lanes(df)) {
    const auto a = around(columns.xl + p), b = around(columns.ll + p), c = around(columns.xx + p),
               n = around(columns.count + p);
    const auto own = hn::Max(least, hn::Mul(share, hn::ConvertTo(df, load(limit + p))));
    const auto rest = hn::Sub(hn::Mul(c, b), hn::Mul(a, a));
    const auto most = hn::Mul(hn::Mul(hn::Mul(own, own), n), b);
    const auto alike = hn::VecFromMask(I32(), hn::RebindMask(I32(), hn::Le(rest, most)));
    hn::StoreU(hn::DemoteTo(U8(), hn::And(alike, load(out + p))), U8(), out + p);
  }
}

}  // namespace

void shaded(const ShadingRows& rows, const uint8_t* black, const uint8_t* asked,
            const uint8_t* limit, const LightRange& range, size_t count, uint8_t* out) {
  Whole whole;
  // Parts of runs are copied into whole ones.
  alignas(64) uint8_t copies[7][kShadingAlong][kWhole];
  const auto begin = [&](const uint8_t* row, size_t step, size_t which) {
    row -= kShadingReach;
    if (count == kShadingRun) return row;
    for (auto& copy : copies[which]) {
      std::fill_n(std::copy_n(row, count + 2 * kShadingReach, copy), kShadingRun - count,
                  uint8_t{0});
      row += step;
    }
    return static_cast<const uint8_t*>(copies[which][0]);
  };
  for (size_t c = 0; c < 3; ++c) {
    whole.rows.x[c] = begin(rows.x[c], rows.x_step, c);
    whole.rows.l[c] = begin(rows.l[c], rows.l_step, 3 + c);
  }
  whole.rows.differing = begin(rows.differing, rows.l_step, 6);
  whole.rows.x_step = count == kShadingRun ? rows.x_step : kWhole;
  whole.rows.l_step = count == kShadingRun ? rows.l_step : kWhole;
  std::fill_n(whole.limit, kWhole, uint8_t{0});
  std::copy_n(limit, count, whole.limit + kShadingReach);
  std::fill_n(whole.asked, kWhole, uint8_t{0});
  std::copy_n(asked, count, whole.asked + kShadingReach);
  alignas(64) uint8_t found[kWhole + kShadingReach];
  // found[p + kShadingReach] is of pixel p, then found[p].
  const bool any = shaded_alone(whole, black, range, found);
  std::copy_n(found + kShadingReach, kShadingRun, found);
  if (any) alike_around(whole, black, range, found);
  std::copy_n(found, count, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(shaded);

void find_shaded(const ShadingRows& rows, const uint8_t* black, const uint8_t* asked,
                 const uint8_t* limit, const LightRange& range, size_t count, uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(shaded)(rows, black, asked, limit, range, count, out);
}

}  // namespace qdmd
#endif
