// SPDX-License-Identifier: LGPL-2.1-or-later
// Bytes as sums of 16 bits: those at even places and those at odd ones. Lanes never move, which
// would take longer than the sums.
// After simd.h, once for each instruction set: no include guard.

#include <bit>

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR
// The first byte in memory is the lowest.
static_assert(std::endian::native == std::endian::little);
struct EvenOdd {
  using Bytes = hn::ScalableTag<uint8_t>;
  using Words = hn::Repartition<uint16_t, Bytes>;
  using V8 = hn::Vec<Bytes>;
  using V16 = hn::Vec<Words>;

  static HWY_INLINE V16 even(V8 x) {
    return hn::And(hn::BitCast(Words(), x), hn::Set(Words(), uint16_t{255}));
  }
  static HWY_INLINE V16 odd(V8 x) { return hn::ShiftRight<8>(hn::BitCast(Words(), x)); }
  // Bytes of sums up to 255.
  static HWY_INLINE V8 joined(V16 even, V16 odd) {
    return hn::BitCast(Bytes(), hn::Or(even, hn::ShiftLeft<8>(odd)));
  }
};
#endif

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();
