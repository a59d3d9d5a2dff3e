// SPDX-License-Identifier: LGPL-2.1-or-later
// Exact inner products of 8-bit planes: the one place where the Gram matrix touches pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace qdmd {

// One way to compute inner products. All give the same bits.
struct Kernel {
  const char* name;
  // out[j * row_count + i] += sum over first <= p < first + length of rows[i][p] * cols[j][p],
  // exactly. Fastest where the rows are the last columns too, which makes half of their products
  // mirror images. `length` may be anything up to 2^46, so that the sums are integers below 2^63.
  // Threads run it: it neither throws nor keeps anything between calls.
  void (*add_dot_products)(const uint8_t* const* rows, size_t row_count, const uint8_t* const* cols,
                           size_t col_count, size_t first, size_t length, int64_t* out) noexcept;
};

// Every kernel that this machine can run, the fastest first.
std::span<const Kernel> kernels();

}  // namespace qdmd
