#include "core/passes/shading.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/shading.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

constexpr int kWhole = static_cast<int>(kShadingRun) + 2 * kShadingReach;

// <x, L>, <L, L>, <x, x> and the number of pixels that differ in columns.
struct Products {
  alignas(64) int32_t xl[kWhole], ll[kWhole], xx[kWhole], count[kWhole];
};

}  // namespace

// Plain loops, which the compiler makes vectors of for each instruction set.

// Of pixels alone. Returns whether any is shaded.
bool shaded_alone(const uint8_t* const* x, const uint8_t* const* l, const uint8_t* black,
                  const uint8_t* HWY_RESTRICT differing, const uint8_t* HWY_RESTRICT limit,
                  int count, uint8_t* HWY_RESTRICT out) {
  const uint8_t *xr = x[kShadingReach], *xg = x[kShadingAlong + kShadingReach],
                *xb = x[2 * kShadingAlong + kShadingReach];
  const uint8_t *lr = l[kShadingReach], *lg = l[kShadingAlong + kShadingReach],
                *lb = l[2 * kShadingAlong + kShadingReach];
  const int red = black[0], green = black[1], blue = black[2];
  int any = 0;
  for (int p = 0; p < count; ++p) {
    const auto r = static_cast<float>(xr[p] - red), g = static_cast<float>(xg[p] - green),
               b = static_cast<float>(xb[p] - blue);
    const auto lit_r = static_cast<float>(lr[p] - red), lit_g = static_cast<float>(lg[p] - green),
               lit_b = static_cast<float>(lb[p] - blue);
    const float xl = r * lit_r + g * lit_g + b * lit_b;
    const float ll = lit_r * lit_r + lit_g * lit_g + lit_b * lit_b;
    // |rest| |L| is the length of the vector part of conj(x) L.
    const float i = g * lit_b - b * lit_g, j = b * lit_r - r * lit_b, k = r * lit_g - g * lit_r;
    const float own = limit[p], most = std::max(36.0f, own * own);
    const bool lit = (ll > 0) & (2 * xl >= ll) & (20 * xl <= 23 * ll);
    const int shaded = lit & (4 * (i * i + j * j + k * k) <= most * ll) ? differing[p] : 0;
    any |= shaded;
    out[p] = static_cast<uint8_t>(shaded);
  }
  return any != 0;
}

void add_row(const uint8_t* HWY_RESTRICT xr, const uint8_t* HWY_RESTRICT xg,
             const uint8_t* HWY_RESTRICT xb, const uint8_t* HWY_RESTRICT lr,
             const uint8_t* HWY_RESTRICT lg, const uint8_t* HWY_RESTRICT lb,
             const uint8_t* HWY_RESTRICT mask, const uint8_t* black, int count,
             Products* HWY_RESTRICT columns) {
  const int red = black[0], green = black[1], blue = black[2];
  for (int p = 0; p < count; ++p) {
    const int r = xr[p] - red, g = xg[p] - green, b = xb[p] - blue;
    const int lit_r = lr[p] - red, lit_g = lg[p] - green, lit_b = lb[p] - blue;
    const int differs = -(mask[p] & 1);
    columns->xl[p] += differs & (r * lit_r + g * lit_g + b * lit_b);
    columns->ll[p] += differs & (lit_r * lit_r + lit_g * lit_g + lit_b * lit_b);
    columns->xx[p] += differs & (r * r + g * g + b * b);
    columns->count[p] -= differs;
  }
}

// Takes out of `out` where the pixels around that differ have another texture. Sums of 25 products
// are below 2^23, which floats hold; the products of two such sums lose less than 0.02 squared
// levels.
void alike_around(const uint8_t* const* x, const uint8_t* const* l, const uint8_t* black,
                  const uint8_t* const* differing, const uint8_t* HWY_RESTRICT limit, int count,
                  uint8_t* HWY_RESTRICT out) {
  const int whole = count + 2 * kShadingReach;
  Products columns;
  std::fill_n(columns.xl, whole, 0), std::fill_n(columns.ll, whole, 0);
  std::fill_n(columns.xx, whole, 0), std::fill_n(columns.count, whole, 0);
  for (int row = 0; row < kShadingAlong; ++row) {
    const auto add = [&](int size) HWY_ATTR {
      add_row(x[row] - kShadingReach, x[kShadingAlong + row] - kShadingReach,
              x[2 * kShadingAlong + row] - kShadingReach, l[row] - kShadingReach,
              l[kShadingAlong + row] - kShadingReach, l[2 * kShadingAlong + row] - kShadingReach,
              differing[row] - kShadingReach, black, size, &columns);
    };
    // No loop for what is left of vectors where there is nothing left.
    if (whole == kWhole)
      add(kWhole);
    else
      add(whole);
  }
  const auto around = [](const int32_t* column) {
    return column[0] + column[1] + column[2] + column[3] + column[4];
  };
  for (int p = 0; p < count; ++p) {
    const auto a = static_cast<float>(around(columns.xl + p)),
               b = static_cast<float>(around(columns.ll + p)),
               c = static_cast<float>(around(columns.xx + p)),
               n = static_cast<float>(around(columns.count + p));
    const float own = limit[p], most = std::max(144.0f, 9 * own * own);
    const bool alike = 16 * (c * b - a * a) <= most * n * b;
    out[p] = alike ? out[p] : 0;
  }
}

void shaded(const uint8_t* const* x, const uint8_t* const* l, const uint8_t* black,
            const uint8_t* const* differing, const uint8_t* limit, int count, uint8_t* out) {
  if (shaded_alone(x, l, black, differing[kShadingReach], limit, count, out))
    alike_around(x, l, black, differing, limit, count, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(shaded);

void find_shaded(const uint8_t* const* x, const uint8_t* const* l, const uint8_t* black,
                 const uint8_t* const* differing, const uint8_t* limit, size_t count,
                 uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(shaded)(x, l, black, differing, limit, static_cast<int>(count), out);
}

}  // namespace qdmd
#endif
