// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/majority.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/majority.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

// Plain loops, which the compiler makes vectors of for each instruction set. As a byte, 255 is -1:
// a sum of them is less their number.

void count_three(const uint8_t* HWY_RESTRICT a, size_t count, uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i) out[i] = static_cast<uint8_t>(-(a[i] + a[i + 1] + a[i + 2]));
}

void count_five(const uint8_t* HWY_RESTRICT a, size_t count, uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i)
    out[i] = static_cast<uint8_t>(-(a[i] + a[i + 1] + a[i + 2] + a[i + 3] + a[i + 4]));
}

// A white pixel needs two, or four, votes less than a black one.

void vote_of_nine(const uint8_t* const* rows, const uint8_t* HWY_RESTRICT own, size_t count,
                  uint8_t* HWY_RESTRICT out) {
  const uint8_t *a = rows[0], *b = rows[1], *c = rows[2];
  for (size_t i = 0; i < count; ++i)
    out[i] =
        static_cast<uint8_t>(a[i] + b[i] + c[i]) > static_cast<uint8_t>(5 - (own[i] & 2)) ? 255 : 0;
}

void vote_of_25(const uint8_t* const* rows, const uint8_t* HWY_RESTRICT own, size_t count,
                uint8_t* HWY_RESTRICT out) {
  const uint8_t *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3], *e = rows[4];
  for (size_t i = 0; i < count; ++i)
    out[i] = static_cast<uint8_t>(a[i] + b[i] + c[i] + d[i] + e[i]) >
                     static_cast<uint8_t>(14 - (own[i] & 4))
                 ? 255
                 : 0;
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(count_three);
HWY_EXPORT(count_five);
HWY_EXPORT(vote_of_nine);
HWY_EXPORT(vote_of_25);

void count_columns(const uint8_t* padded, size_t count, int reach, uint8_t* out) {
  if (reach == 1)
    HWY_DYNAMIC_DISPATCH(count_three)(padded, count, out);
  else
    HWY_DYNAMIC_DISPATCH(count_five)(padded, count, out);
}

void vote_row(const uint8_t* const* rows, const uint8_t* own, size_t count, int reach,
              uint8_t* out) {
  if (reach == 1)
    HWY_DYNAMIC_DISPATCH(vote_of_nine)(rows, own, count, out);
  else
    HWY_DYNAMIC_DISPATCH(vote_of_25)(rows, own, count, out);
}

}  // namespace qdmd
#endif
