// SPDX-License-Identifier: LGPL-2.1-or-later
// What is found in the rows of a picture by several threads, as one list in the rows' order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace qdmd {

template <typename T>
class RowLists {
 public:
  RowLists() = default;
  // Takes all memory: for `most` of each row.
  RowLists(size_t rows, size_t most) : most_(most), found_(rows * most), counts_(rows) {}
  static uint64_t bytes(uint64_t rows, uint64_t most) {
    return rows * (most * sizeof(T) + sizeof(size_t));
  }

  // Of a row that nobody else writes to.
  void clear(size_t row) { counts_[row] = 0; }
  void add(size_t row, const T& what) { found_[row * most_ + counts_[row]++] = what; }

  // All rows' one after another; `all` has room for them.
  void collect(std::vector<T>* all) const {
    all->clear();
    for (size_t row = 0; row < counts_.size(); ++row) {
      const auto first = found_.begin() + static_cast<ptrdiff_t>(row * most_);
      all->insert(all->end(), first, first + static_cast<ptrdiff_t>(counts_[row]));
    }
  }

 private:
  size_t most_ = 0;
  std::vector<T> found_;
  std::vector<size_t> counts_;
};

}  // namespace qdmd
