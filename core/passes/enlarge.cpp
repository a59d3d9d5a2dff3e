// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/enlarge.h"

#include <algorithm>
#include <cstdlib>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/enlarge.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

// Plain loops, which the compiler makes vectors of for each instruction set.

template <size_t kScale>
void repeat(const uint8_t* HWY_RESTRICT row, size_t width, uint8_t* HWY_RESTRICT out) {
  const size_t whole = width / kScale;
  for (size_t k = 0; k < whole; ++k)
    for (size_t j = 0; j < kScale; ++j) out[kScale * k + j] = row[k];
  for (size_t p = whole * kScale; p < width; ++p) out[p] = row[whole];
}

void repeat2(const uint8_t* row, size_t width, uint8_t* out) { repeat<2>(row, width, out); }
void repeat4(const uint8_t* row, size_t width, uint8_t* out) { repeat<4>(row, width, out); }

// Samples that are worked on together.
constexpr size_t kPart = 512;

// Calls make(sums, first, size, j) with what lies j steps of kScale to the right of the edge of
// each of `size` samples, times (2 kScale)^2: a sample and those beside it have their shares. The
// border's samples stand for those outside, unless rows are padded by one sample on both sides.
template <size_t kScale, bool kPadded, typename Make>
HWY_INLINE void interpolate(const uint8_t* HWY_RESTRICT row, const uint8_t* HWY_RESTRICT beside,
                            size_t count, int phase, Make make) {
  // In 2 kScale-ths; 16 bits hold (2 kScale)^2 samples.
  constexpr auto kAll = static_cast<uint16_t>(2 * kScale);
  const auto away = [](int step) {
    return static_cast<uint16_t>(std::abs(2 * step + 1 - static_cast<int>(kScale)));
  };
  const auto others = away(phase), own = static_cast<uint16_t>(kAll - others);
  const auto at = [&](ptrdiff_t k) {
    return static_cast<uint16_t>(own * row[k] + others * beside[k]);
  };
  uint16_t between[kPart + 2], sums[kPart];
  for (size_t first = 0; first < count; first += kPart) {
    const size_t size = std::min(kPart, count - first);
    for (size_t k = 0; k < size; ++k) between[k + 1] = at(static_cast<ptrdiff_t>(first + k));
    const auto begin = static_cast<ptrdiff_t>(first), end = static_cast<ptrdiff_t>(first + size),
               last = static_cast<ptrdiff_t>(count) - 1;
    between[0] = at(kPadded ? begin - 1 : std::max<ptrdiff_t>(begin - 1, 0));
    between[size + 1] = at(kPadded ? end : std::min(end, last));
    for (size_t j = 0; j < kScale; ++j) {
      const auto outer = away(static_cast<int>(j)), inner = static_cast<uint16_t>(kAll - outer);
      const uint16_t* const neighbours = between + (j < kScale / 2 ? 0 : 2);
      for (size_t k = 0; k < size; ++k)
        sums[k] = static_cast<uint16_t>(inner * between[k + 1] + outer * neighbours[k]);
      make(sums, first, size, j);
    }
  }
}

template <size_t kScale>
constexpr auto kHalf = static_cast<uint16_t>(2 * kScale * kScale);
// 9/16 of what is added up.
template <size_t kScale>
constexpr auto kEdge = static_cast<uint16_t>(9 * kScale * kScale / 4);

template <size_t kScale>
HWY_INLINE void enlarge(const uint8_t* row, const uint8_t* beside, size_t count, int phase,
                        size_t width, uint8_t* out) {
  uint8_t larger[kScale * kPart];
  interpolate<kScale, false>(
      row, beside, count, phase, [&](const uint16_t* sums, size_t first, size_t size, size_t j) {
        for (size_t k = 0; k < size; ++k)
          larger[kScale * k + j] = static_cast<uint8_t>(
              static_cast<uint16_t>(sums[k] + kHalf<kScale>) / (2 * kHalf<kScale>));
        if (j + 1 == kScale)
          std::copy_n(larger, std::min(kScale * size, width - kScale * first),
                      out + kScale * first);
      });
}

template <size_t kScale>
HWY_INLINE void find_edge(const uint8_t* residual, const uint8_t* beside, const uint8_t* means,
                          const uint8_t* mask, size_t count, int phase, size_t width,
                          uint8_t* out) {
  uint8_t larger[kScale * kPart];
  interpolate<kScale, true>(
      residual, beside, count, phase,
      [&](const uint16_t* sums, size_t first, size_t size, size_t j) {
        for (size_t k = 0; k < size; ++k)
          larger[kScale * k + j] =
              sums[k] >= static_cast<uint16_t>(kEdge<kScale> * means[first + k]) ? mask[first + k]
                                                                                 : 0;
        if (j + 1 == kScale)
          std::copy_n(larger, std::min(kScale * size, width - kScale * first),
                      out + kScale * first);
      });
}

// Residuals are 0 where the mask is.
void means_of_nine(const uint8_t* const* residual, const uint8_t* const* mask, size_t count,
                   uint8_t* HWY_RESTRICT means) {
  const uint8_t *a = residual[0] - 1, *b = residual[1] - 1, *c = residual[2] - 1;
  const uint8_t *u = mask[0] - 1, *v = mask[1] - 1, *w = mask[2] - 1;
  uint16_t sums[kPart];
  uint8_t set[kPart];
  for (size_t first = 0; first < count; first += kPart) {
    const size_t size = std::min(kPart, count - first);
    for (size_t i = 0; i < size; ++i) {
      const size_t k = first + i;
      sums[i] = static_cast<uint16_t>(a[k] + a[k + 1] + a[k + 2] + b[k] + b[k + 1] + b[k + 2] +
                                      c[k] + c[k + 1] + c[k + 2]);
      // As a byte, 255 is -1: a sum of them is less their number.
      set[i] = static_cast<uint8_t>(
          -(u[k] + u[k + 1] + u[k + 2] + v[k] + v[k + 1] + v[k + 2] + w[k] + w[k + 1] + w[k + 2]));
    }
    for (size_t i = 0; i < size; ++i) {
      const float number = set[i] == 0 ? 1.0f : set[i];
      const auto mean = static_cast<uint8_t>(static_cast<int>(sums[i] / number + 0.5f));
      means[first + i] = set[i] == 9 ? 0 : mean;
    }
  }
}

void enlarge2(const uint8_t* row, const uint8_t* beside, size_t count, int phase, size_t width,
              uint8_t* out) {
  enlarge<2>(row, beside, count, phase, width, out);
}
void enlarge4(const uint8_t* row, const uint8_t* beside, size_t count, int phase, size_t width,
              uint8_t* out) {
  enlarge<4>(row, beside, count, phase, width, out);
}

void find_edge2(const uint8_t* residual, const uint8_t* beside, const uint8_t* means,
                const uint8_t* mask, size_t count, int phase, size_t width, uint8_t* out) {
  find_edge<2>(residual, beside, means, mask, count, phase, width, out);
}
void find_edge4(const uint8_t* residual, const uint8_t* beside, const uint8_t* means,
                const uint8_t* mask, size_t count, int phase, size_t width, uint8_t* out) {
  find_edge<4>(residual, beside, means, mask, count, phase, width, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(repeat2);
HWY_EXPORT(repeat4);
HWY_EXPORT(enlarge2);
HWY_EXPORT(enlarge4);
HWY_EXPORT(find_edge2);
HWY_EXPORT(find_edge4);
HWY_EXPORT(means_of_nine);

void repeat_row(const uint8_t* row, int scale, size_t width, uint8_t* out) {
  if (scale == 2)
    HWY_DYNAMIC_DISPATCH(repeat2)(row, width, out);
  else
    HWY_DYNAMIC_DISPATCH(repeat4)(row, width, out);
}

void enlarge_row(const uint8_t* row, const uint8_t* beside, size_t count, int scale, int phase,
                 size_t width, uint8_t* out) {
  if (scale == 2)
    HWY_DYNAMIC_DISPATCH(enlarge2)(row, beside, count, phase, width, out);
  else
    HWY_DYNAMIC_DISPATCH(enlarge4)(row, beside, count, phase, width, out);
}

void edge_row(const uint8_t* residual, const uint8_t* beside, const uint8_t* means,
              const uint8_t* mask, size_t count, int scale, int phase, size_t width, uint8_t* out) {
  if (scale == 2)
    HWY_DYNAMIC_DISPATCH(find_edge2)(residual, beside, means, mask, count, phase, width, out);
  else
    HWY_DYNAMIC_DISPATCH(find_edge4)(residual, beside, means, mask, count, phase, width, out);
}

void find_means(const uint8_t* const residual[3], const uint8_t* const mask[3], size_t count,
                uint8_t* means) {
  HWY_DYNAMIC_DISPATCH(means_of_nine)(residual, mask, count, means);
}

}  // namespace qdmd
#endif
