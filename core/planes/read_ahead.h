// SPDX-License-Identifier: LGPL-2.1-or-later
// Asks for what a pass over snapshots that lie in a file reads next.
#pragma once

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "core/planes/snapshot_range.h"

namespace qdmd {

// For passes that read the same pixels of many snapshots, each thread from some pixel on. Runs of
// them are short, and snapshots far apart: they are asked for in parts that are large enough for a
// disk, and together small enough for little memory.
class ReadAhead {
 public:
  // Snapshots `which`; and all.
  ReadAhead(const SnapshotRange& snapshots, std::vector<int> which, size_t threads)
      : snapshots_(snapshots),
        which_(std::move(which)),
        part_(std::max(kBytes / (bytes_of_pixel(snapshots) * (which_.size() + 1)), kLeast)),
        asked_(threads) {}
  ReadAhead(const SnapshotRange& snapshots, size_t threads)
      : ReadAhead(snapshots, all_of(snapshots), threads) {}

  // Pixels that are asked for at once.
  size_t part() const { return part_; }

  // Thread `worker` is about to read pixels first .. first + count - 1.
  void read(size_t worker, size_t first, size_t count) {
    if (!snapshots_.on_disk()) return;
    Asked& asked = asked_[worker];
    if (first < asked.begin || first > asked.end) asked = {first, first};
    while (asked.end < std::min(first + count + part_, snapshots_.pixels())) ask(&asked);
  }

 private:
  static constexpr size_t kBytes = size_t{1} << 24, kLeast = size_t{1} << 13;
  struct Asked {
    size_t begin = 1, end = 0;
  };

  static size_t bytes_of_pixel(const SnapshotRange& snapshots) {
    const auto bytes = static_cast<size_t>(sample_bytes(snapshots.depth()));
    return snapshots.shape().is_shared() ? 2 * bytes : kChannels * bytes;
  }
  static std::vector<int> all_of(const SnapshotRange& snapshots) {
    std::vector<int> all(static_cast<size_t>(snapshots.on_disk() ? snapshots.size() : 0));
    std::iota(all.begin(), all.end(), 0);
    return all;
  }
  void ask(Asked* asked) const {
    const size_t count = std::min(part_, snapshots_.pixels() - asked->end);
    for (int t : which_) snapshots_.will_need(t, asked->end, count);
    asked->end += count;
  }

  const SnapshotRange snapshots_;
  const std::vector<int> which_;
  const size_t part_;  // pixels
  std::vector<Asked> asked_;
};

}  // namespace qdmd
