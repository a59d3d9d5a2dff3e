#include "core/gram/kernel.h"

#include <algorithm>

namespace qdmd {
namespace {

// Pixels per block: a block's 32-bit sum is at most 8192 * 255^2 < 2^30, and the rows of one
// snapshot (3 x 8 KiB) stay in the first-level cache while the columns stream past.
constexpr size_t kBlock = 8192;

int32_t block_dot(const uint8_t* x, const uint8_t* y, size_t length) {
  int32_t sum = 0;
  // 16-bit factors are what compilers turn into multiply-add instructions.
  for (size_t p = 0; p < length; ++p)
    sum += static_cast<int16_t>(x[p]) * static_cast<int16_t>(y[p]);
  return sum;
}

}  // namespace

void dot_products(const uint8_t* const* rows, size_t row_count, const uint8_t* const* cols,
                  size_t col_count, size_t length, int64_t* out) {
  std::fill(out, out + row_count * col_count, int64_t{0});
  for (size_t start = 0; start < length; start += kBlock) {
    const size_t count = std::min(kBlock, length - start);
    for (size_t j = 0; j < col_count; ++j)
      for (size_t i = 0; i < row_count; ++i)
        out[i * col_count + j] += block_dot(rows[i] + start, cols[j] + start, count);
  }
}

}  // namespace qdmd
