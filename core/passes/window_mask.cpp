// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/window_mask.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace qdmd {

WindowMask::WindowMask(int capacity, size_t pixels)
    : words_(mask_bytes(pixels) / kWord),
      groups_((words_ + kRuns - 1) / kRuns),
      kept_(words_ * static_cast<size_t>(capacity)),
      of_snapshots_(groups_ * static_cast<size_t>(capacity)),
      begins_(static_cast<size_t>(capacity)) {}

uint64_t WindowMask::bytes(int capacity, size_t pixels) {
  const uint64_t words = mask_bytes(pixels) / kWord, groups = (words + kRuns - 1) / kRuns;
  return static_cast<uint64_t>(capacity) *
         (words * kWord + groups * sizeof(Group) + sizeof(size_t));
}

void WindowMask::keep(size_t snapshot, const uint8_t* bits) noexcept {
  const auto word_of = [bits](size_t index) {
    uint64_t word;
    std::memcpy(&word, bits + index * kWord, kWord);
    return word;
  };
  Group* const groups = of_snapshots_.data() + snapshot * groups_;
  uint32_t count = 0;
  for (size_t g = 0; g < groups_; ++g) {
    const size_t first = g * kRuns, runs = std::min(kRuns, words_ - first);
    groups[g] = {0, count};
    for (size_t i = 0; i < runs; ++i) groups[g].kept |= uint64_t{word_of(first + i) != 0} << i;
    count += static_cast<uint32_t>(std::popcount(groups[g].kept));
  }
  const size_t begin = std::atomic_ref(used_).fetch_add(count, std::memory_order_relaxed);
  begins_[snapshot] = begin;
  uint64_t* to = kept_.data() + begin;
  for (size_t g = 0; g < groups_; ++g)
    for (uint64_t left = groups[g].kept; left != 0; left &= left - 1)
      *to++ = word_of(g * kRuns + static_cast<size_t>(std::countr_zero(left)));
}

void WindowMask::read(int snapshot, size_t first, size_t count, uint8_t* bits) const {
  std::memset(bits, 0, count / 8);
  const auto index = static_cast<size_t>(snapshot);
  const Group* const groups = of_snapshots_.data() + index * groups_;
  const uint64_t* const kept = kept_.data() + begins_[index];
  const size_t begin = first / kRun, end = begin + count / kRun;
  for (size_t g = begin / kRuns; g * kRuns < end; ++g) {
    const Group& group = groups[g];
    // Runs of this group, from the first one on.
    const uint64_t before = g * kRuns < begin ? (uint64_t{1} << (begin - g * kRuns)) - 1 : 0;
    const uint64_t* from = kept + group.before + std::popcount(group.kept & before);
    for (uint64_t left = group.kept & ~before; left != 0; left &= left - 1) {
      const size_t run = g * kRuns + static_cast<size_t>(std::countr_zero(left));
      if (run >= end) break;
      std::memcpy(bits + (run - begin) * kWord, from++, kWord);
    }
  }
}

}  // namespace qdmd
