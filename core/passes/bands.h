// How a pass over pixels is divided: among threads, and over time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/parallel/pool.h"

namespace qdmd {

// Part `index` of `count` of something.
struct Slice {
  int index = 0, count = 1;

  // Of `length` samples: where the part begins and how long it is. Parts begin at multiples of
  // `unit`, as equal as that allows.
  size_t first(size_t length, size_t unit) const { return boundary(index, length, unit); }
  size_t size(size_t length, size_t unit) const {
    return boundary(index + 1, length, unit) - boundary(index, length, unit);
  }

 private:
  size_t boundary(int i, size_t length, size_t unit) const {
    if (i == count) return length;
    return length / unit * static_cast<size_t>(i) / static_cast<size_t>(count) * unit;
  }
};

// Calls band(first, size, worker) for bands of about equal size that cover [0, length), `count` of
// them, on the pool's threads (Pool::run).
template <typename Band>
void for_bands(Pool& pool, int length, int count, Band band) {
  pool.run(static_cast<size_t>(count), [&](size_t part, size_t worker) {
    const auto boundary = [&](size_t i) {
      return static_cast<int>(int64_t{length} * static_cast<int64_t>(i) / count);
    };
    band(boundary(part), boundary(part + 1) - boundary(part), worker);
  });
}

}  // namespace qdmd
