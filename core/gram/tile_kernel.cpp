#include "core/gram/tile_kernel.h"

#include <algorithm>
#include <cstring>

// The part up to HWY_ONCE is compiled for each instruction set but these: some are never the best,
// vectors of others have no size that the compiler knows.
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#define HWY_WANT_AVX3_DL 1
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/gram/tile_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
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

// Each lane of 32 bits multiplies a step of neighbouring pixels of a row and a column and adds them
// up. A tile is some vectors of rows, one row a lane, times kCols columns; it and what goes into it
// fit the registers.
#if HWY_TARGET == HWY_AVX3_DL
// Unsigned columns, as they are in the window, times signed rows: level - 128.
constexpr size_t kStep = 4, kVectors = 3, kCols = 8;
using ColSample = uint8_t;
constexpr int kRowOffset = 128;
#else
// Factors of 16 bits.
constexpr size_t kStep = 2, kVectors = 2, kCols = 4;
using ColSample = int16_t;
constexpr int kRowOffset = 0;
#endif

// Pixels per block. A sum of 32 bits holds 33025 products of 255 by 255, and 65793 of 255 by -128;
// the packed rows stay in the second-level cache while the columns stream past.
constexpr size_t kBlock = 1024 * kStep;
static_assert(kBlock * 255 * 255 < (size_t{1} << 31));

// One step, in one lane.
template <typename Sample>
HWY_INLINE int32_t step_at(const Sample* samples) {
  static_assert(kStep * sizeof(Sample) == sizeof(int32_t));
  int32_t step;
  std::memcpy(&step, samples, sizeof(step));
  return step;
}

// The pixels of a step of a row, as its samples in one lane.
HWY_INLINE int32_t row_step(const uint8_t* row) {
#if HWY_TARGET == HWY_AVX3_DL
  // Less 128 is the highest bit turned.
  return static_cast<int32_t>(static_cast<uint32_t>(step_at(row)) ^ 0x80808080u);
#else
  return row[0] | row[1] << 16;
#endif
}

// The sums of one column with the rows of kCount vectors. Variables, because compilers keep arrays
// of vectors in memory.
template <size_t kCount>
struct Sums {
  V32 a, b, c, odd_a, odd_b, odd_c;

  HWY_INLINE void clear() { a = b = c = odd_a = odd_b = odd_c = hn::Zero(D32()); }
  HWY_INLINE void add(const ColSample* col, V32 row_a, V32 row_b, V32 row_c) {
    const V32 step = hn::Set(D32(), step_at(col));
    multiply_add(step, row_a, &a, &odd_a);
    if constexpr (kCount > 1) multiply_add(step, row_b, &b, &odd_b);
    if constexpr (kCount > 2) multiply_add(step, row_c, &c, &odd_c);
  }
  HWY_INLINE void store(int32_t* out) const {
    hn::StoreU(hn::RearrangeToOddPlusEven(a, odd_a), D32(), out);
    if constexpr (kCount > 1) hn::StoreU(hn::RearrangeToOddPlusEven(b, odd_b), D32(), out + kLanes);
    if constexpr (kCount > 2)
      hn::StoreU(hn::RearrangeToOddPlusEven(c, odd_c), D32(), out + 2 * kLanes);
  }

 private:
  static HWY_INLINE void multiply_add(V32 col, V32 row, V32* sum, V32* odd) {
#if HWY_TARGET == HWY_AVX3_DL
    (void)odd;
    // Highway 1.0 has no name for it, and its compiler flags for this target leave it out.
    asm("vpdpbusd %2, %1, %0" : "+v"(sum->raw) : "v"(col.raw), "v"(row.raw));
#else
    const hn::RepartitionToNarrow<D32> d16;
    *sum = hn::ReorderWidenMulAccumulate(D32(), hn::BitCast(d16, col), hn::BitCast(d16, row), *sum,
                                         *odd);
#endif
  }
};

// packed: for each step, kCount vectors of rows. cols: kCols columns. out: for each column, its
// sums with the rows.
template <size_t kCount>
HWY_NOINLINE void tile(const int32_t* packed, const ColSample* const* cols, size_t steps,
                       int32_t* out) {
  constexpr size_t kRows = kCount * kLanes;
  const D32 d;
  const auto vector = [&](size_t step, size_t index) HWY_ATTR {
    return hn::LoadU(d, packed + step * kRows + std::min(index, kCount - 1) * kLanes);
  };
  const ColSample *col0 = cols[0], *col1 = cols[1], *col2 = cols[2], *col3 = cols[3];
  Sums<kCount> s0, s1, s2, s3;
  s0.clear(), s1.clear(), s2.clear(), s3.clear();
  if constexpr (kCols == 8) {
    const ColSample *col4 = cols[4], *col5 = cols[5], *col6 = cols[6], *col7 = cols[7];
    Sums<kCount> s4, s5, s6, s7;
    s4.clear(), s5.clear(), s6.clear(), s7.clear();
    for (size_t k = 0; k < steps; ++k) {
      const V32 a = vector(k, 0), b = vector(k, 1), c = vector(k, 2);
      const size_t p = k * kStep;
      s0.add(col0 + p, a, b, c), s1.add(col1 + p, a, b, c);
      s2.add(col2 + p, a, b, c), s3.add(col3 + p, a, b, c);
      s4.add(col4 + p, a, b, c), s5.add(col5 + p, a, b, c);
      s6.add(col6 + p, a, b, c), s7.add(col7 + p, a, b, c);
    }
    s4.store(out + 4 * kRows), s5.store(out + 5 * kRows);
    s6.store(out + 6 * kRows), s7.store(out + 7 * kRows);
  } else {
    for (size_t k = 0; k < steps; ++k) {
      const V32 a = vector(k, 0), b = vector(k, 1);
      const size_t p = k * kStep;
      s0.add(col0 + p, a, b, b), s1.add(col1 + p, a, b, b);
      s2.add(col2 + p, a, b, b), s3.add(col3 + p, a, b, b);
    }
  }
  s0.store(out), s1.store(out + kRows), s2.store(out + 2 * kRows), s3.store(out + 3 * kRows);
}

// One group of at most kVectors x kLanes rows with all columns, over one block of pixels.
class Group {
 public:
  // Rows from `start` on, `steps` steps of each.
  void pack(const uint8_t* const* rows, size_t count, size_t start, size_t steps) {
    count_ = count;
    steps_ = steps;
    vectors_ = (count + kLanes - 1) / kLanes;
    const size_t stride = vectors_ * kLanes;
    for (size_t r = 0; r < stride; ++r) {
      // Lanes without a row repeat the first one; nobody takes their sums.
      const uint8_t* row = rows[r < count ? r : 0] + start;
      for (size_t k = 0; k < steps; ++k) packed_[k * stride + r] = row_step(row + k * kStep);
    }
  }

  // out[i * col_count + j] += sums of the block.
  void multiply(const uint8_t* const* cols, size_t col_count, size_t start, int64_t* out) {
    const size_t stride = vectors_ * kLanes;
    for (size_t j = 0; j < col_count; j += kCols) {
      const size_t here = std::min(kCols, col_count - j);
      const ColSample* columns[kCols];
      int64_t correction[kCols];
      for (size_t k = 0; k < kCols; ++k) {
        const uint8_t* col = cols[j + std::min(k, here - 1)] + start;
        columns[k] = samples_of(col, k);
        correction[k] = kRowOffset ? kRowOffset * sum_of(col) : 0;
      }
      if (vectors_ == 1) tile<1>(packed_, columns, steps_, sums_);
      if (vectors_ == 2) tile<2>(packed_, columns, steps_, sums_);
      if (vectors_ == 3) tile<3>(packed_, columns, steps_, sums_);
      for (size_t i = 0; i < count_; ++i)
        for (size_t k = 0; k < here; ++k)
          out[i * col_count + j + k] += sums_[k * stride + i] + correction[k];
    }
  }

 private:
#if HWY_TARGET == HWY_AVX3_DL
  const uint8_t* samples_of(const uint8_t* col, size_t) { return col; }
#else
  const int16_t* samples_of(const uint8_t* col, size_t index) {
    std::copy_n(col, steps_ * kStep, widened_[index]);
    return widened_[index];
  }
  int16_t widened_[kCols][kBlock];
#endif

  int64_t sum_of(const uint8_t* col) const {
    const hn::ScalableTag<uint8_t> d8;
    const hn::Repartition<uint64_t, decltype(d8)> d64;
    auto sums = hn::Zero(d64);
    const size_t length = steps_ * kStep, n = hn::Lanes(d8);
    size_t p = 0;
    for (; p + n <= length; p += n) sums = hn::Add(sums, hn::SumsOf8(hn::LoadU(d8, col + p)));
    auto sum = static_cast<int64_t>(hn::GetLane(hn::SumOfLanes(d64, sums)));
    for (; p < length; ++p) sum += col[p];
    return sum;
  }

  alignas(64) int32_t packed_[kVectors * kLanes * kBlock / kStep];
  alignas(64) int32_t sums_[kVectors * kLanes * kCols];
  size_t count_ = 0, steps_ = 0, vectors_ = 0;
};

}  // namespace

void add_dot_products(const uint8_t* const* rows, size_t row_count, const uint8_t* const* cols,
                      size_t col_count, size_t first, size_t length, int64_t* out) noexcept {
  constexpr size_t kGroup = kVectors * kLanes;
  // Some 200 KiB of stack: there is no allocation that could fail.
  Group group;
  const size_t whole = length / kStep * kStep;
  for (size_t done = 0; done < whole; done += kBlock)
    for (size_t i = 0; i < row_count; i += kGroup) {
      group.pack(rows + i, std::min(kGroup, row_count - i), first + done,
                 std::min(kBlock, whole - done) / kStep);
      group.multiply(cols, col_count, first + done, out + i * col_count);
    }
  for (size_t p = first + whole; p < first + length; ++p)
    for (size_t i = 0; i < row_count; ++i)
      for (size_t j = 0; j < col_count; ++j) out[i * col_count + j] += rows[i][p] * cols[j][p];
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();
#endif

#if HWY_ONCE
namespace qdmd {

std::vector<Kernel> tile_kernels() {
  struct Compiled {
    int64_t target;
    Kernel kernel;
  };
  static constexpr Compiled kCompiled[] = {
#if HWY_TARGETS & HWY_AVX3_DL
    {HWY_AVX3_DL, {"avx512-vnni", N_AVX3_DL::add_dot_products}},
#endif
#if HWY_TARGETS & HWY_AVX2
    {HWY_AVX2, {"avx2", N_AVX2::add_dot_products}},
#endif
#if HWY_TARGETS & HWY_NEON
    {HWY_NEON, {"neon", N_NEON::add_dot_products}},
#endif
    {0, {"none", nullptr}},
  };
  std::vector<Kernel> kernels;
  for (const Compiled& compiled : kCompiled)
    if (hwy::SupportedTargets() & compiled.target) kernels.push_back(compiled.kernel);
  return kernels;
}

}  // namespace qdmd
#endif
