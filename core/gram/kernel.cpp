// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/gram/kernel.h"

#include <algorithm>
#include <array>
#include <vector>

#include "core/gram/tile_kernel.h"

namespace qdmd {
namespace {

// Pixels per block: a block's 32-bit sum is at most 4096 * 255^2 < 2^29, and three widened rows
// (24 KiB) stay in the first-level cache while the columns stream past.
constexpr size_t kBlock = 4096;
constexpr size_t kRows = 3;

using WideRow = std::array<int16_t, kBlock>;

// Three rows share each load of the column. Factors of 16 bits are what compilers turn into
// multiply-add instructions; rows are widened once for all columns.
void block_dots(const std::array<WideRow, kRows>& rows, const uint8_t* col, size_t length,
                int32_t sums[kRows]) {
  int32_t sum0 = 0, sum1 = 0, sum2 = 0;
  for (size_t p = 0; p < length; ++p) {
    const int16_t sample = col[p];
    sum0 += rows[0][p] * sample;
    sum1 += rows[1][p] * sample;
    sum2 += rows[2][p] * sample;
  }
  sums[0] = sum0;
  sums[1] = sum1;
  sums[2] = sum2;
}

void widened(const uint8_t* const* rows, size_t row_count, const uint8_t* const* cols,
             size_t col_count, size_t first, size_t length, int64_t* out) noexcept {
  std::array<WideRow, kRows> wide{};
  for (size_t done = 0; done < length; done += kBlock) {
    const size_t start = first + done, count = std::min(kBlock, length - done);
    for (size_t i = 0; i < row_count; i += kRows) {
      // A group that is not full repeats old rows; their sums are not taken.
      const size_t group = std::min(kRows, row_count - i);
      for (size_t k = 0; k < group; ++k) std::copy_n(rows[i + k] + start, count, wide[k].begin());
      for (size_t j = 0; j < col_count; ++j) {
        int32_t sums[kRows];
        block_dots(wide, cols[j] + start, count, sums);
        for (size_t k = 0; k < group; ++k) out[j * row_count + i + k] += sums[k];
      }
    }
  }
}

// The definition, without blocks: what the other kernels are compared with.
void reference(const uint8_t* const* rows, size_t row_count, const uint8_t* const* cols,
               size_t col_count, size_t first, size_t length, int64_t* out) noexcept {
  for (size_t i = 0; i < row_count; ++i)
    for (size_t j = 0; j < col_count; ++j) {
      int64_t sum = 0;
      for (size_t p = first; p < first + length; ++p) sum += int64_t{rows[i][p]} * cols[j][p];
      out[j * row_count + i] += sum;
    }
}

}  // namespace

std::span<const Kernel> kernels() {
  static const std::vector<Kernel> kKernels = [] {
    std::vector<Kernel> all = tile_kernels();
    all.push_back({"widened", widened});
    all.push_back({"reference", reference});
    return all;
  }();
  return kKernels;
}

}  // namespace qdmd
