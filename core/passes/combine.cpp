// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/combine.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/combine.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Four sums at two vectors of pixels. Variables, because compilers keep arrays of vectors in
// memory.
template <class D>
struct Sums {
  using V = hn::Vec<D>;
  V a0, a1, b0, b1, c0, c1, e0, e1;

  // One that the compiler makes would not be for this instruction set: on ARM that is an error.
  HWY_INLINE Sums() {}
  HWY_INLINE void clear() { a0 = a1 = b0 = b1 = c0 = c1 = e0 = e1 = hn::Zero(D()); }
  template <typename T>
  HWY_INLINE void add(const double* coefficients, const T* samples) {
    const D d;
    const V x0 = load(samples), x1 = load(samples + hn::Lanes(d));
    const V a = hn::Set(d, coefficients[0]), b = hn::Set(d, coefficients[1]);
    const V c = hn::Set(d, coefficients[2]), e = hn::Set(d, coefficients[3]);
    a0 = hn::MulAdd(a, x0, a0), a1 = hn::MulAdd(a, x1, a1);
    b0 = hn::MulAdd(b, x0, b0), b1 = hn::MulAdd(b, x1, b1);
    c0 = hn::MulAdd(c, x0, c0), c1 = hn::MulAdd(c, x1, c1);
    e0 = hn::MulAdd(e, x0, e0), e1 = hn::MulAdd(e, x1, e1);
  }
  HWY_INLINE void store(float* const* out, size_t used, size_t p) const {
    store_one(a0, a1, out[0] + p);
    if (used > 1) store_one(b0, b1, out[1] + p);
    if (used > 2) store_one(c0, c1, out[2] + p);
    if (used > 3) store_one(e0, e1, out[3] + p);
  }

 private:
  template <typename T>
  static HWY_INLINE V load(const T* from) {
    const hn::Rebind<int32_t, D> d32;
    const hn::Rebind<T, D> d_samples;
    return hn::PromoteTo(D(), hn::PromoteTo(d32, hn::LoadU(d_samples, from)));
  }
  static HWY_INLINE void store_one(V x0, V x1, float* to) {
    const hn::Rebind<float, D> d32;
    hn::StoreU(hn::DemoteTo(d32, x0), d32, to);
    hn::StoreU(hn::DemoteTo(d32, x1), d32, to + hn::Lanes(d32));
  }
};

// How sums, to which `offset` of their channel is added, become samples: times `scale`, plus `bias`
// (a half: rounded to nearest), at most `top`.
struct Rounding {
  float scale, bias, top;
  const Offset& offset;
};

template <class D, typename T>
size_t level_vectors(const float* weights, const float* const* pictures, size_t picture_count,
                     const Rounding& rounding, size_t p, size_t first, size_t count,
                     T* const* out) {
  const D d;
  const hn::Rebind<int32_t, D> d32;
  const hn::Rebind<T, D> d_samples;
  const float* red = weights;
  const float* green = weights + picture_count;
  const float* blue = weights + 2 * picture_count;
  // Adding a half and truncating rounds to nearest in the range that survives the clamp.
  const auto bias = hn::Set(d, rounding.bias), zero = hn::Zero(d), top = hn::Set(d, rounding.top);
  // With bytes the bias comes first: it is one step less.
  const float before = sizeof(T) > 1 ? 0 : rounding.bias;
  const auto first_red = hn::Set(d, before + rounding.offset[0]),
             first_green = hn::Set(d, before + rounding.offset[1]),
             first_blue = hn::Set(d, before + rounding.offset[2]);
  const auto scale = hn::Set(d, rounding.scale);
  const auto store = [&](hn::Vec<D> sum, T* to) HWY_ATTR {
    if constexpr (sizeof(T) > 1) sum = hn::MulAdd(scale, sum, bias);
    // The comparison sends a NaN (infinity less infinity) to zero.
    const auto positive = hn::IfThenElseZero(hn::Gt(sum, zero), sum);
    const auto whole = hn::ConvertTo(d32, hn::Min(positive, top));
    hn::StoreU(hn::DemoteTo(d_samples, whole), d_samples, to);
  };
  (void)scale, (void)bias;
  for (; p + hn::Lanes(d) <= count; p += hn::Lanes(d)) {
    auto r = first_red, g = first_green, b = first_blue;
    for (size_t k = 0; k < picture_count; ++k) {
      const float* from = pictures[k] + first + p;
      // The next run's: other frames' work has driven it out of the cache, and the hardware
      // foresees nothing beyond a page.
      hwy::Prefetch(from + kMaxRun);
      const auto level = hn::LoadU(d, from);
      r = hn::MulAdd(hn::Set(d, red[k]), level, r);
      g = hn::MulAdd(hn::Set(d, green[k]), level, g);
      b = hn::MulAdd(hn::Set(d, blue[k]), level, b);
    }
    store(r, out[0] + p);
    store(g, out[1] + p);
    store(b, out[2] + p);
  }
  return p;
}

}  // namespace

// coefficients: four of each plane. used: how many of the four sums somebody takes.
template <typename T>
HWY_INLINE void combine(const double* coefficients, const T* const* planes, size_t plane_count,
                        size_t first, size_t count, size_t used, float* const* sums) {
  using D = hn::ScalableTag<double>;
  const size_t lanes = hn::Lanes(D()), block = 4 * lanes;
  for (size_t p = 0; p < count; p += block) {
    Sums<D> low, high;
    low.clear(), high.clear();
    for (size_t j = 0; j < plane_count; ++j) {
      const T* from = planes[j] + first + p;
      // The planes are too many streams for the hardware to foresee.
      hwy::Prefetch(from + 256);
      low.add(coefficients + 4 * j, from);
      high.add(coefficients + 4 * j, from + 2 * lanes);
    }
    if (p + block <= count) {
      low.store(sums, used, p);
      high.store(sums, used, p + 2 * lanes);
      continue;
    }
    alignas(64) float last[4][4 * HWY_MAX_BYTES / sizeof(double)];
    float* const rows[4] = {last[0], last[1], last[2], last[3]};
    low.store(rows, used, 0);
    high.store(rows, used, 2 * lanes);
    for (size_t k = 0; k < used; ++k) std::copy_n(last[k], count - p, sums[k] + p);
  }
}

void combine_four(const double* coefficients, const uint8_t* const* planes, size_t plane_count,
                  size_t first, size_t count, size_t used, float* const* sums) {
  combine(coefficients, planes, plane_count, first, count, used, sums);
}
void combine_four_deep(const double* coefficients, const uint16_t* const* planes,
                       size_t plane_count, size_t first, size_t count, size_t used,
                       float* const* sums) {
  combine(coefficients, planes, plane_count, first, count, used, sums);
}

// Products and sums are rounded one by one, whatever the vectors can do.
template <class D>
size_t level_in_place(const float* weights, size_t picture_count, size_t stride, size_t p,
                      size_t count, float* samples, const Offset& offset) {
  const D d;
  for (; p + hn::Lanes(d) <= count; p += hn::Lanes(d)) {
    auto r = hn::Set(d, offset[0]), g = hn::Set(d, offset[1]), b = hn::Set(d, offset[2]);
    for (size_t k = 0; k < picture_count; ++k) {
      const auto level = hn::LoadU(d, samples + k * stride + p);
      r = hn::Add(r, hn::Mul(hn::Set(d, weights[k]), level));
      g = hn::Add(g, hn::Mul(hn::Set(d, weights[picture_count + k]), level));
      b = hn::Add(b, hn::Mul(hn::Set(d, weights[2 * picture_count + k]), level));
    }
    hn::StoreU(r, d, samples + p);
    hn::StoreU(g, d, samples + stride + p);
    hn::StoreU(b, d, samples + 2 * stride + p);
  }
  return p;
}

// Pixels that fill no vector take the same steps one by one, so that a pixel's bits do not depend
// on where a run begins.
template <typename T>
HWY_INLINE void all_levels(const float* weights, const float* const* pictures, size_t picture_count,
                           const Rounding& rounding, size_t first, size_t count, T* const* out) {
  const size_t p = level_vectors<hn::ScalableTag<float>>(weights, pictures, picture_count, rounding,
                                                         0, first, count, out);
  level_vectors<hn::CappedTag<float, 1>>(weights, pictures, picture_count, rounding, p, first,
                                         count, out);
}

void levels_in_place(const float* weights, size_t picture_count, size_t count, float* samples,
                     const Offset& offset) {
  const size_t p = level_in_place<hn::ScalableTag<float>>(weights, picture_count, count, 0, count,
                                                          samples, offset);
  level_in_place<hn::CappedTag<float, 1>>(weights, picture_count, count, p, count, samples, offset);
}

void levels(const float* weights, const float* const* pictures, size_t picture_count, float bias,
            const Offset& offset, size_t first, size_t count, uint8_t* const* out) {
  all_levels(weights, pictures, picture_count, {1, bias, 255, offset}, first, count, out);
}
void deep_levels(const float* weights, const float* const* pictures, size_t picture_count,
                 int depth, const Offset& offset, size_t first, size_t count,
                 uint16_t* const* out) {
  const auto scale = static_cast<float>(1 << (depth - 8));
  all_levels(weights, pictures, picture_count, {scale, 0.5f, 256 * scale - 1, offset}, first, count,
             out);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(combine_four);
HWY_EXPORT(combine_four_deep);
HWY_EXPORT(levels);
HWY_EXPORT(deep_levels);
HWY_EXPORT(levels_in_place);

}  // namespace

void combine_planes(const double* coefficients, size_t sum_count, const uint8_t* const* planes,
                    size_t plane_count, size_t first, size_t count, float* const* sums) {
  for (size_t k = 0; k < sum_count; k += 4) HWY_DYNAMIC_DISPATCH(combine_four)
  (coefficients + k * plane_count, planes, plane_count, first, count,
   std::min<size_t>(4, sum_count - k), sums + k);
}

void combine_planes(const double* coefficients, size_t sum_count, const uint16_t* const* planes,
                    size_t plane_count, size_t first, size_t count, float* const* sums) {
  for (size_t k = 0; k < sum_count; k += 4) HWY_DYNAMIC_DISPATCH(combine_four_deep)
  (coefficients + k * plane_count, planes, plane_count, first, count,
   std::min<size_t>(4, sum_count - k), sums + k);
}

void levels_of(const float* weights, const float* const* pictures, size_t picture_count,
               size_t first, size_t count, uint8_t* const out[3], const Offset& offset) {
  HWY_DYNAMIC_DISPATCH(levels)(weights, pictures, picture_count, 0.5f, offset, first, count, out);
}

void high_digits_of(const float* weights, const float* const* pictures, size_t picture_count,
                    size_t first, size_t count, uint8_t* const out[3], const Offset& offset) {
  HWY_DYNAMIC_DISPATCH(levels)(weights, pictures, picture_count, 0, offset, first, count, out);
}

void deep_levels_of(const float* weights, const float* const* pictures, size_t picture_count,
                    int depth, size_t first, size_t count, uint16_t* const out[3],
                    const Offset& offset) {
  HWY_DYNAMIC_DISPATCH(deep_levels)
  (weights, pictures, picture_count, depth, offset, first, count, out);
}

void levels_in_place(const float* weights, size_t picture_count, size_t count, float* samples,
                     const Offset& offset) {
  HWY_DYNAMIC_DISPATCH(levels_in_place)(weights, picture_count, count, samples, offset);
}

}  // namespace qdmd
#endif
