// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/gram/tile_kernel.h"

#include <algorithm>
#include <cstring>

#if defined(__x86_64__) || defined(__i386__)
#include <cpuid.h>
#endif

// The part up to HWY_ONCE is compiled for each instruction set but these: some are never the best,
// vectors of others have no size that the compiler knows.
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#define HWY_WANT_AVX3_DL 1
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/gram/tile_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

// Without vectors a plain loop does as well: kernel.cpp has one.
#if HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using D32 = hn::ScalableTag<int32_t>;
using V32 = hn::Vec<D32>;
constexpr size_t kLanes = HWY_LANES(int32_t);

// 128 bits: the steps of one row that are packed at once.
using Block = hn::FixedTag<int32_t, 4>;
constexpr size_t kBlockSteps = 4;

// Pixels that are asked for ahead of their turn: so many planes are read at once that machines do
// not follow all of them by themselves.
constexpr size_t kCacheLine = 64, kAhead = 512;

// One step, in one lane.
template <typename Sample>
HWY_INLINE int32_t step_at(const Sample* samples) {
  int32_t step;
  std::memcpy(&step, samples, sizeof(step));
  return step;
}

// Each lane of 32 bits multiplies a step of neighbouring pixels of a row and a column and adds them
// up. An arithmetic says how. A tile is kVectors vectors of rows, one row a lane, times kCols
// columns; it and what goes into it fit the registers. The packed rows of kPixels pixels stay in
// the second-level cache while the columns stream past, and 32 bits hold their sums.

#if HWY_TARGET == HWY_AVX3_DL || HWY_TARGET == HWY_AVX2
// Unsigned rows times signed columns: level - 128, which is the highest bit turned. What that adds
// is the product with a black column.
struct Bytes {
  static constexpr size_t kStep = 4, kPixels = 4096;
#if HWY_TARGET == HWY_AVX2
  static constexpr size_t kVectors = 3, kCols = 4;
#else
  static constexpr size_t kVectors = 3, kCols = 8;
#endif
  static_assert(kPixels * 255 * 128 < (size_t{1} << 31));
  static constexpr bool kOffset = true;
  using ColSample = uint8_t;
#if HWY_TARGET == HWY_AVX2
  HWY_ALIGN static constexpr uint64_t kHighestBits[4] = {0x8080808080808080u, 0x8080808080808080u,
                                                         0x8080808080808080u, 0x8080808080808080u};
#endif

  static HWY_INLINE int32_t row_step(const uint8_t* row) { return step_at(row); }
  static HWY_INLINE hn::Vec<Block> row_block(const uint8_t* row) {
    return hn::BitCast(Block(), hn::LoadU(hn::Repartition<uint8_t, Block>(), row));
  }
  static HWY_INLINE V32 col_vector(int32_t step) {
    V32 col = hn::Set(D32(), step);
#if HWY_TARGET == HWY_AVX2
    // From memory: all 16 registers are taken, and compilers would rather spill a sum.
    asm("vpxor %1, %0, %0" : "+x"(col.raw) : "m"(kHighestBits));
    return col;
#else
    return hn::Xor(col, hn::Set(D32(), INT32_C(-0x7f7f7f80)));
#endif
  }
  static HWY_INLINE void multiply_add(V32 col, V32 row, V32* sum, V32*) {
    // Highway 1.0 has no name for it, and its compiler flags for these targets leave it out.
#if HWY_TARGET == HWY_AVX2
    asm("%{vex%} vpdpbusd %2, %1, %0" : "+x"(sum->raw) : "x"(row.raw), "x"(col.raw));
#else
    asm("vpdpbusd %2, %1, %0" : "+v"(sum->raw) : "v"(row.raw), "v"(col.raw));
#endif
  }
};
#endif

#if HWY_TARGET != HWY_AVX3_DL
// Factors of 16 bits.
struct Words {
  static constexpr size_t kStep = 2, kVectors = 2, kCols = 4, kPixels = 2048;
  static_assert(kPixels * 255 * 255 < (size_t{1} << 31));
  static constexpr bool kOffset = false;
  using ColSample = int16_t;

  static HWY_INLINE int32_t row_step(const uint8_t* row) { return row[0] | row[1] << 16; }
  static HWY_INLINE hn::Vec<Block> row_block(const uint8_t* row) {
    const hn::Repartition<int16_t, Block> d16;
    const hn::Rebind<uint8_t, decltype(d16)> d8;
    return hn::BitCast(Block(), hn::PromoteTo(d16, hn::LoadU(d8, row)));
  }
  static HWY_INLINE V32 col_vector(int32_t step) { return hn::Set(D32(), step); }
  static HWY_INLINE void multiply_add(V32 col, V32 row, V32* sum, V32* odd) {
    const hn::RepartitionToNarrow<D32> d16;
    *sum = hn::ReorderWidenMulAccumulate(D32(), hn::BitCast(d16, col), hn::BitCast(d16, row), *sum,
                                         *odd);
  }
};
#endif

// The sums of one column with the rows of kCount vectors. Variables, because compilers keep arrays
// of vectors in memory.
template <class Arithmetic, size_t kCount>
struct Sums {
  V32 a, b, c, odd_a, odd_b, odd_c;

  // Not a constructor, which would not be compiled for the target.
  static HWY_INLINE Sums zero() {
    const V32 z = hn::Zero(D32());
    return {z, z, z, z, z, z};
  }
  HWY_INLINE void add(const typename Arithmetic::ColSample* col, V32 row_a, V32 row_b, V32 row_c) {
    add(Arithmetic::col_vector(step_at(col)), row_a, row_b, row_c);
  }
  HWY_INLINE void add(V32 col, V32 row_a, V32 row_b, V32 row_c) {
    Arithmetic::multiply_add(col, row_a, &a, &odd_a);
    if constexpr (kCount > 1) Arithmetic::multiply_add(col, row_b, &b, &odd_b);
    if constexpr (kCount > 2) Arithmetic::multiply_add(col, row_c, &c, &odd_c);
  }
  HWY_INLINE void store(int32_t* out) const {
    hn::StoreU(hn::RearrangeToOddPlusEven(a, odd_a), D32(), out);
    if constexpr (kCount > 1) hn::StoreU(hn::RearrangeToOddPlusEven(b, odd_b), D32(), out + kLanes);
    if constexpr (kCount > 2)
      hn::StoreU(hn::RearrangeToOddPlusEven(c, odd_c), D32(), out + 2 * kLanes);
  }
};

// packed: for each step, `stride` lanes, kCount vectors of which are multiplied. cols: kCols
// columns. out: for each column, its sums with those rows.
template <class Arithmetic, size_t kCount>
HWY_NOINLINE void tile(const int32_t* packed, size_t stride,
                       const typename Arithmetic::ColSample* const* cols, size_t steps,
                       int32_t* out) {
  using ColSample = typename Arithmetic::ColSample;
  constexpr size_t kRows = kCount * kLanes, kStep = Arithmetic::kStep;
  const D32 d;
  const auto vector = [&](size_t step, size_t index) HWY_ATTR {
    return hn::LoadU(d, packed + step * stride + std::min(index, kCount - 1) * kLanes);
  };
  const ColSample *col0 = cols[0], *col1 = cols[1], *col2 = cols[2], *col3 = cols[3];
  using Column = Sums<Arithmetic, kCount>;
  Column s0 = Column::zero(), s1 = s0, s2 = s0, s3 = s0;
  if constexpr (Arithmetic::kCols == 8) {
    const ColSample *col4 = cols[4], *col5 = cols[5], *col6 = cols[6], *col7 = cols[7];
    Column s4 = s0, s5 = s0, s6 = s0, s7 = s0;
    for (size_t k = 0; k < steps; ++k) {
      const V32 a = vector(k, 0), b = vector(k, 1), c = vector(k, 2);
      const size_t p = k * kStep;
      if (p % kCacheLine == 0) {
        hwy::Prefetch(col0 + p + kAhead), hwy::Prefetch(col1 + p + kAhead);
        hwy::Prefetch(col2 + p + kAhead), hwy::Prefetch(col3 + p + kAhead);
        hwy::Prefetch(col4 + p + kAhead), hwy::Prefetch(col5 + p + kAhead);
        hwy::Prefetch(col6 + p + kAhead), hwy::Prefetch(col7 + p + kAhead);
      }
      s0.add(col0 + p, a, b, c), s1.add(col1 + p, a, b, c);
      s2.add(col2 + p, a, b, c), s3.add(col3 + p, a, b, c);
      s4.add(col4 + p, a, b, c), s5.add(col5 + p, a, b, c);
      s6.add(col6 + p, a, b, c), s7.add(col7 + p, a, b, c);
    }
    s4.store(out + 4 * kRows), s5.store(out + 5 * kRows);
    s6.store(out + 6 * kRows), s7.store(out + 7 * kRows);
  } else {
    for (size_t k = 0; k < steps; ++k) {
      const V32 a = vector(k, 0), b = vector(k, 1), c = vector(k, 2);
      const size_t p = k * kStep;
      s0.add(col0 + p, a, b, c), s1.add(col1 + p, a, b, c);
      s2.add(col2 + p, a, b, c), s3.add(col3 + p, a, b, c);
    }
  }
  s0.store(out), s1.store(out + kRows), s2.store(out + 2 * kRows), s3.store(out + 3 * kRows);
}

// A vector whose blocks are steps of every fourth row.
template <class Arithmetic, class D>
HWY_INLINE hn::Vec<D> row_blocks(D d, const uint8_t* const* rows, size_t start) {
  constexpr size_t kRows = hn::MaxLanes(D());
  if constexpr (kRows == kBlockSteps) {
    (void)d;
    return Arithmetic::row_block(rows[0] + start);
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, row_blocks<Arithmetic>(half, rows + kRows / 2, start),
                       row_blocks<Arithmetic>(half, rows, start));
  }
}

// Where sums go: out[j * row_count + i] is of row i and column j. Columns from `diagonal` on are
// the rows themselves: each pair of them is multiplied once and added at both its places.
struct Target {
  int64_t* out;
  size_t row_count, col_count, diagonal;
  size_t first_row;  // of the packed ones
};

// At most kVectors x kLanes rows with all columns, over at most kPixels pixels.
template <class Arithmetic>
class Rows {
 public:
  static constexpr size_t kMost = Arithmetic::kVectors * kLanes;

  // Pixels from `start` on, `steps` steps of each row.
  void pack(const uint8_t* const* rows, size_t count, size_t start, size_t steps) {
    count_ = count;
    steps_ = steps;
    vectors_ = (count + kLanes - 1) / kLanes;
    for (size_t v = 0; v < vectors_; ++v) {
      // Lanes without a row repeat the last one; nobody takes their sums.
      const uint8_t* lanes[kLanes];
      for (size_t k = 0; k < kLanes; ++k) lanes[k] = rows[std::min(v * kLanes + k, count - 1)];
      pack_vector(lanes, start, packed_ + v * kLanes, offset_ + v * kLanes);
    }
  }

  // Adds the sums of the packed pixels of each row and column to `out`.
  void multiply(const uint8_t* const* cols, size_t start, const Target& target) {
    const size_t first_row = target.diagonal + target.first_row;
    const size_t col_count = std::min(target.col_count, first_row + count_);
    for (size_t j = 0; j < col_count; j += Arithmetic::kCols) {
      const size_t here = std::min(Arithmetic::kCols, col_count - j);
      const ColSample* columns[Arithmetic::kCols];
      for (size_t k = 0; k < Arithmetic::kCols; ++k)
        columns[k] = samples_of(cols[j + std::min(k, here - 1)] + start, k);
      // Whole vectors above the diagonal are left out.
      const size_t skipped = j > first_row ? (j - first_row) / kLanes : 0;
      const int32_t* packed = packed_ + skipped * kLanes;
      const size_t stride = vectors_ * kLanes, computed = vectors_ - skipped;
      if (computed == 1) tile<Arithmetic, 1>(packed, stride, columns, steps_, sums_);
      if (computed == 2) tile<Arithmetic, 2>(packed, stride, columns, steps_, sums_);
      if constexpr (Arithmetic::kVectors > 2)
        if (computed == 3) tile<Arithmetic, 3>(packed, stride, columns, steps_, sums_);
      for (size_t k = 0; k < here; ++k)
        add_sums(sums_ + k * computed * kLanes, skipped * kLanes, j + k, target);
    }
  }

 private:
  using ColSample = typename Arithmetic::ColSample;

  void pack_vector(const uint8_t* const* rows, size_t start, int32_t* packed, int32_t* offset) {
    const D32 d;
    const hn::Repartition<uint64_t, D32> d64;
    const size_t stride = vectors_ * kLanes;
    const V32 black = Arithmetic::col_vector(0);
    // Four, so that a sum need not wait for the one before.
    auto sums0 = Sums<Arithmetic, 1>::zero(), sums1 = sums0, sums2 = sums0, sums3 = sums0;
    const auto put = [&](size_t step, V32 lanes, auto& black_sums) HWY_ATTR {
      hn::StoreU(lanes, d, packed + step * stride);
      if constexpr (Arithmetic::kOffset) black_sums.add(black, lanes, lanes, lanes);
    };
    const auto pair = [&](auto low, auto high) HWY_ATTR {
      return hn::BitCast(d,
                         hn::InterleaveLower(d64, hn::BitCast(d64, low), hn::BitCast(d64, high)));
    };
    const auto upper_pair = [&](auto low, auto high) HWY_ATTR {
      return hn::BitCast(d,
                         hn::InterleaveUpper(d64, hn::BitCast(d64, low), hn::BitCast(d64, high)));
    };
    size_t k = 0;
    for (; k + kBlockSteps <= steps_; k += kBlockSteps) {
      const size_t p = start + k * Arithmetic::kStep;
      if (p / kCacheLine != (p - kBlockSteps * Arithmetic::kStep) / kCacheLine)
        for (size_t r = 0; r < kLanes; ++r) hwy::Prefetch(rows[r] + p + kAhead);
      const V32 row0 = row_blocks<Arithmetic>(d, rows, p);
      const V32 row1 = row_blocks<Arithmetic>(d, rows + 1, p);
      const V32 row2 = row_blocks<Arithmetic>(d, rows + 2, p);
      const V32 row3 = row_blocks<Arithmetic>(d, rows + 3, p);
      const V32 low01 = hn::InterleaveLower(d, row0, row1);
      const V32 low23 = hn::InterleaveLower(d, row2, row3);
      const V32 high01 = hn::InterleaveUpper(d, row0, row1);
      const V32 high23 = hn::InterleaveUpper(d, row2, row3);
      put(k, pair(low01, low23), sums0), put(k + 1, upper_pair(low01, low23), sums1);
      put(k + 2, pair(high01, high23), sums2), put(k + 3, upper_pair(high01, high23), sums3);
    }
    for (; k < steps_; ++k) {
      HWY_ALIGN int32_t lanes[kLanes];
      for (size_t r = 0; r < kLanes; ++r)
        lanes[r] = Arithmetic::row_step(rows[r] + start + k * Arithmetic::kStep);
      put(k, hn::Load(d, lanes), sums0);
    }
    sums0.a = hn::Add(hn::Add(sums0.a, sums1.a), hn::Add(sums2.a, sums3.a));
    sums0.store(offset);
  }

  // sums: of column j with the rows from `begin` on.
  void add_sums(const int32_t* sums, size_t begin, size_t j, const Target& target) const {
    int64_t* column = target.out + j * target.row_count + target.first_row;
    if (j < target.diagonal) {
      for (size_t i = 0; i < count_; ++i) column[i] += int64_t{sums[i]} - offset_[i];
      return;
    }
    const size_t diagonal_row = j - target.diagonal;
    const size_t below = std::max(diagonal_row, target.first_row) - target.first_row;
    for (size_t i = below; i < count_; ++i) {
      const size_t row = target.first_row + i;
      const int64_t sum = int64_t{sums[i - begin]} - offset_[i];
      column[i] += sum;
      if (row > diagonal_row)
        target.out[(target.diagonal + row) * target.row_count + diagonal_row] += sum;
    }
  }

  // The packed pixels of a column, the `index`-th of a tile, as the arithmetic takes them.
  const ColSample* samples_of(const uint8_t* col, size_t index) {
    if constexpr (kWiden) {
      std::copy_n(col, steps_ * Arithmetic::kStep, widened_[index]);
      return widened_[index];
    } else {
      (void)index;
      return col;
    }
  }

  alignas(64) int32_t packed_[kMost * Arithmetic::kPixels / Arithmetic::kStep];
  alignas(64) int32_t sums_[kMost * Arithmetic::kCols];
  alignas(64) int32_t offset_[kMost];  // sums with a black column
  static constexpr bool kWiden = sizeof(ColSample) > 1;
  ColSample widened_[Arithmetic::kCols][kWiden ? Arithmetic::kPixels : 1];
  size_t count_ = 0, steps_ = 0, vectors_ = 0;
};

template <class Arithmetic>
void add_dot_products(const uint8_t* const* rows, size_t row_count, const uint8_t* const* cols,
                      size_t col_count, size_t first, size_t length, int64_t* out) noexcept {
  constexpr size_t kStep = Arithmetic::kStep, kMost = Rows<Arithmetic>::kMost;
  const bool rows_are_last_columns =
      row_count <= col_count && std::equal(rows, rows + row_count, cols + col_count - row_count);
  const size_t diagonal = rows_are_last_columns ? col_count - row_count : col_count;
  // Some 200 KiB of stack: there is no allocation that could fail.
  Rows<Arithmetic> packed;
  const size_t steps = length / kStep;
  // Blocks have the same size, because the last one would otherwise be small and slow.
  const size_t blocks = (steps * kStep + Arithmetic::kPixels - 1) / Arithmetic::kPixels;
  for (size_t block = 0; block < blocks; ++block)
    for (size_t i = 0; i < row_count; i += kMost) {
      const size_t begin = steps * block / blocks, end = steps * (block + 1) / blocks;
      const size_t count = std::min(kMost, row_count - i), start = first + begin * kStep;
      packed.pack(rows + i, count, start, end - begin);
      packed.multiply(cols, start, {out, row_count, col_count, diagonal, i});
    }
  for (size_t p = first + steps * kStep; p < first + length; ++p)
    for (size_t j = 0; j < col_count; ++j)
      for (size_t i = 0; i < row_count; ++i) out[j * row_count + i] += rows[i][p] * cols[j][p];
}

}  // namespace

#if HWY_TARGET == HWY_AVX3_DL || HWY_TARGET == HWY_AVX2
void (*const kBytes)(const uint8_t* const*, size_t, const uint8_t* const*, size_t, size_t, size_t,
                     int64_t*) noexcept = add_dot_products<Bytes>;
#endif
#if HWY_TARGET != HWY_AVX3_DL
void (*const kWords)(const uint8_t* const*, size_t, const uint8_t* const*, size_t, size_t, size_t,
                     int64_t*) noexcept = add_dot_products<Words>;
#endif

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();
#endif

#if HWY_ONCE
namespace qdmd {
namespace {

#if HWY_TARGETS & HWY_AVX2
// Highway has no target of AVX2 with VNNI.
bool has_avx_vnni() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid_count(7, 1, &a, &b, &c, &d) && (a & (1u << 4));
}
#endif

}  // namespace

std::vector<Kernel> tile_kernels() {
  std::vector<Kernel> kernels;
  const auto runs = [](int64_t target) { return (hwy::SupportedTargets() & target) != 0; };
#if HWY_TARGETS & HWY_AVX3_DL
  if (runs(HWY_AVX3_DL)) kernels.push_back({"avx512-vnni", N_AVX3_DL::kBytes});
#endif
#if HWY_TARGETS & HWY_AVX2
  if (runs(HWY_AVX2) && has_avx_vnni()) kernels.push_back({"avx-vnni", N_AVX2::kBytes});
  if (runs(HWY_AVX2)) kernels.push_back({"avx2", N_AVX2::kWords});
#endif
#if HWY_TARGETS & HWY_NEON
  if (runs(HWY_NEON)) kernels.push_back({"neon", N_NEON::kWords});
#endif
  return kernels;
}

}  // namespace qdmd
#endif
