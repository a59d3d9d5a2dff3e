// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/distance.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/distance.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Squares saturate: the sum of three is above 65535 for distances that nobody compares.
template <class D16, class V8>
HWY_INLINE hn::Vec<D16> square(D16 d16, V8 a, V8 b) {
  const auto distance = hn::PromoteTo(d16, hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)));
  return hn::Mul(distance, distance);
}

// From pixel p on, as many as fill whole vectors; returns the first that is left.
template <class D16>
HWY_INLINE size_t nearest(D16 d16, const uint8_t* const* x, const uint8_t* const* rows,
                          int rows_along, int reach, int step, size_t p, size_t count,
                          uint16_t* out) {
  const hn::Rebind<uint8_t, D16> d8;
  for (; p + hn::Lanes(d16) <= count; p += hn::Lanes(d16)) {
    const auto r = hn::LoadU(d8, x[0] + p), g = hn::LoadU(d8, x[1] + p),
               b = hn::LoadU(d8, x[2] + p);
    auto least = hn::Set(d16, 65535);
    for (int i = 0; i < rows_along; ++i) {
      const uint8_t* const red = rows[i] + p;
      const uint8_t* const green = rows[rows_along + i] + p;
      const uint8_t* const blue = rows[2 * rows_along + i] + p;
      for (int shift = -reach * step; shift <= reach * step; shift += step) {
        const auto sum =
            hn::SaturatedAdd(hn::SaturatedAdd(square(d16, r, hn::LoadU(d8, red + shift)),
                                              square(d16, g, hn::LoadU(d8, green + shift))),
                             square(d16, b, hn::LoadU(d8, blue + shift)));
        least = hn::Min(least, sum);
      }
    }
    hn::StoreU(least, d16, out + p);
  }
  return p;
}

}  // namespace

void nearest_of(const uint8_t* const* x, const uint8_t* const* rows, int rows_along, int reach,
                int step, size_t count, uint16_t* out) {
  const size_t p =
      nearest(hn::ScalableTag<uint16_t>(), x, rows, rows_along, reach, step, 0, count, out);
  nearest(hn::CappedTag<uint16_t, 1>(), x, rows, rows_along, reach, step, p, count, out);
}

// A plain loop, which the compiler makes vectors of for each instruction set.
void smoothed(const uint8_t* const* x, const uint8_t* const* l, size_t count,
              uint16_t* HWY_RESTRICT out) {
  constexpr size_t kRun = 256;
  for (size_t first = 0; first < count; first += kRun) {
    const size_t size = count - first < kRun ? count - first : kRun;
    float sums[kRun] = {};
    for (size_t c = 0; c < 3; ++c) {
      int columns[kRun + 2];
      const uint8_t *a = x[3 * c] + first - 1, *b = x[3 * c + 1] + first - 1,
                    *e = x[3 * c + 2] + first - 1;
      const uint8_t *f = l[3 * c] + first - 1, *g = l[3 * c + 1] + first - 1,
                    *h = l[3 * c + 2] + first - 1;
      for (size_t p = 0; p < size + 2; ++p) columns[p] = a[p] + b[p] + e[p] - f[p] - g[p] - h[p];
      for (size_t p = 0; p < size; ++p) {
        const auto sum = static_cast<float>(columns[p] + columns[p + 1] + columns[p + 2]);
        sums[p] += sum * sum;
      }
    }
    // Sums become the means, rounded to the nearest.
    for (size_t p = 0; p < size; ++p) {
      const float squared = sums[p] * (1.0f / 81) + 0.5f;
      out[first + p] = static_cast<uint16_t>(squared < 65535 ? static_cast<int>(squared) : 65535);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(nearest_of);
HWY_EXPORT(smoothed);

void squared_distance(const uint8_t* const x[3], const uint8_t* const l[3], size_t count,
                      uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(nearest_of)(x, l, 1, 0, 1, count, out);
}

void nearest_distance(const uint8_t* const x[3], const uint8_t* const* rows, size_t count, int step,
                      uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(nearest_of)(x, rows, kPlacesAlong, kPlaces, step, count, out);
}

void smoothed_distance(const uint8_t* const* x, const uint8_t* const* l, size_t count,
                       uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(smoothed)(x, l, count, out);
}

}  // namespace qdmd
#endif
