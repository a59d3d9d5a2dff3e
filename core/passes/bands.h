// SPDX-License-Identifier: LGPL-2.1-or-later
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

  // The part of `length` samples: where the part begins and how long it is. Parts begin at
  // multiples of `unit`, as equal as that allows.
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

// Calls work(first, size, worker) for bands of about equal size that cover [0, length), `count` of
// them, on the pool's threads (Pool::run).
template <typename Work>
void for_bands(Pool& pool, int length, int count, Work work) {
  pool.run(static_cast<size_t>(count), [&](size_t part, size_t worker) {
    const auto boundary = [&](size_t i) {
      return static_cast<int>(int64_t{length} * static_cast<int64_t>(i) / count);
    };
    work(boundary(part), boundary(part + 1) - boundary(part), worker);
  });
}

// Pixels whose share of a pass over a frame is worth waking a thread for.
inline constexpr size_t kWorthAThread = 16384;
// Whether several threads are worth it for so many pixels in all.
inline bool is_shared_out(size_t pixels) { return pixels >= 2 * kWorthAThread; }

// for_bands() for `pixels` pixels in all, on as many threads as that is worth; on the caller's
// where the pool is null. work(first, size).
template <typename Work>
void for_rows(Pool* pool, int length, size_t pixels, Work work) {
  const auto most = static_cast<size_t>(std::max(length, 1));
  const auto count = static_cast<int>(std::clamp<size_t>(pixels / kWorthAThread, 1, most));
  if (pool && count > 1)
    for_bands(*pool, length, count, [&](int first, int size, size_t) { work(first, size); });
  else
    work(0, length);
}

}  // namespace qdmd
