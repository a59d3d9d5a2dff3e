// SPDX-License-Identifier: LGPL-2.1-or-later
// Who goes with whom: the cheapest pairs of two sets.
#pragma once

#include <cstddef>
#include <vector>

namespace qdmd {

// The Hungarian method (Kuhn 1955, Munkres 1957) with potentials, O(n^2 m). It keeps its memory.
class Assignment {
 public:
  // cost: rows x cols numbers, row by row, finite. Gives for each row its column, or -1 where there
  // are more rows than columns: as many pairs as there can be, with the least sum. Good until the
  // next call. May throw std::bad_alloc.
  const std::vector<int>& solve(const std::vector<double>& cost, size_t rows, size_t cols);

 private:
  void take_row(size_t row, size_t cols);

  std::vector<double> cost_;
  std::vector<double> of_row_, of_col_, least_;
  std::vector<size_t> row_at_, way_;
  std::vector<char> done_;
  std::vector<int> result_;
};

}  // namespace qdmd
