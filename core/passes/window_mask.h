// SPDX-License-Identifier: LGPL-2.1-or-later
// The masks of a window's snapshots, of which only what is set takes memory.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/large_vector.h"
#include "core/parallel/pool.h"
#include "core/passes/mask.h"

namespace qdmd {

// Runs of 64 pixels of which none is masked are not kept: most are such ones, and a window in 4:2:0
// is only twelve times as large as all bits.
class WindowMask {
 public:
  WindowMask() = default;
  // Takes the memory of masks that are set everywhere, and touches none of it.
  WindowMask(int capacity, size_t pixels);
  static uint64_t bytes(int capacity, size_t pixels);
  // What find_all() takes beside it.
  static uint64_t scratch_bytes(size_t pixels, int threads) {
    return uint64_t{mask_bytes(pixels)} * static_cast<uint64_t>(threads);
  }

  // Becomes the masks of snapshots 0 .. count - 1. find(snapshot, worker, bits) writes one of them,
  // mask_bytes() of bits, on the pool's threads.
  template <typename Find>
  void find_all(int count, Pool* pool, const Find& find) {
    const size_t size = words_ * kWord;
    // Taken here: tasks of the pool take no memory.
    const auto bits = std::make_unique_for_overwrite<uint8_t[]>(size * pool->threads());
    used_ = 0;
    pool->run(static_cast<size_t>(count), [&](size_t snapshot, size_t worker) {
      uint8_t* const own = bits.get() + worker * size;
      find(static_cast<int>(snapshot), worker, own);
      keep(snapshot, own);
    });
  }
  // Reads a snapshot's pixels first .. first + count - 1, multiples of 64 up to the end of its
  // mask.
  void read(int snapshot, size_t first, size_t count, uint8_t* bits) const;
  // All of it: mask_bytes().
  void read(int snapshot, uint8_t* bits) const { read(snapshot, 0, words_ * kRun, bits); }

 private:
  static constexpr size_t kRun = 64, kWord = kRun / 8;  // pixels, and bytes of their bits
  // As many runs as an integer has bits: those that are kept, and how many of the snapshot's are
  // before them.
  struct Group {
    uint64_t kept;
    uint32_t before;
  };
  static constexpr size_t kRuns = 64;

  void keep(size_t snapshot, const uint8_t* bits) noexcept;

  size_t words_ = 0, groups_ = 0;  // of a snapshot
  LargeVector<uint64_t> kept_;     // runs, a snapshot's after each other
  LargeVector<Group> of_snapshots_;
  LargeVector<size_t> begins_;  // where a snapshot's runs do
  size_t used_ = 0;             // of kept_; threads add to it
};

}  // namespace qdmd
