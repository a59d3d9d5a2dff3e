// SPDX-License-Identifier: LGPL-2.1-or-later
// The median of rows of levels, sample by sample.
#pragma once

#include <cstddef>

namespace qdmd {

// Rows, at most.
constexpr int kMedianRows = 64;

// median[i] = the median of rows[0 .. count - 1][i], each divided by its row's divisor; the upper
// of the middle two where count is even.
void median_rows(const float* const* rows, const float* divisors, size_t count, size_t width,
                 float* median);

}  // namespace qdmd
