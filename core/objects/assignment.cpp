// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/objects/assignment.h"

#include <limits>

namespace qdmd {

// Rows and columns are counted from 1 here: 0 stands for none.
void Assignment::take_row(size_t row, size_t cols) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const auto cost = [&](size_t r, size_t c) { return cost_[(r - 1) * cols + c - 1]; };
  row_at_[0] = row;
  least_.assign(cols + 1, kFar);
  done_.assign(cols + 1, 0);
  size_t at = 0;
  do {
    done_[at] = 1;
    const size_t its = row_at_[at];
    double step = kFar;
    size_t next = 0;
    for (size_t c = 1; c <= cols; ++c) {
      if (done_[c]) continue;
      const double reduced = cost(its, c) - of_row_[its] - of_col_[c];
      if (reduced < least_[c]) least_[c] = reduced, way_[c] = at;
      if (least_[c] < step) step = least_[c], next = c;
    }
    for (size_t c = 0; c <= cols; ++c) {
      if (done_[c])
        of_row_[row_at_[c]] += step, of_col_[c] -= step;
      else
        least_[c] -= step;
    }
    at = next;
  } while (row_at_[at] != 0);
  for (; at != 0; at = way_[at]) row_at_[at] = row_at_[way_[at]];
}

const std::vector<int>& Assignment::solve(const std::vector<double>& cost, size_t rows,
                                          size_t cols) {
  result_.assign(rows, -1);
  if (rows == 0 || cols == 0) return result_;
  // There are at least as many columns as rows.
  const bool turned = rows > cols;
  const size_t n = turned ? cols : rows, m = turned ? rows : cols;
  cost_.resize(n * m);
  for (size_t r = 0; r < rows; ++r)
    for (size_t c = 0; c < cols; ++c) cost_[turned ? c * m + r : r * m + c] = cost[r * cols + c];
  of_row_.assign(n + 1, 0);
  of_col_.assign(m + 1, 0);
  row_at_.assign(m + 1, 0);
  way_.assign(m + 1, 0);
  for (size_t row = 1; row <= n; ++row) take_row(row, m);
  for (size_t c = 1; c <= m; ++c) {
    if (row_at_[c] == 0) continue;
    const size_t row = row_at_[c] - 1, col = c - 1;
    result_[turned ? col : row] = static_cast<int>(turned ? row : col);
  }
  return result_;
}

}  // namespace qdmd
