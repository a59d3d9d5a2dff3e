// SPDX-License-Identifier: LGPL-2.1-or-later
// Loops over runs of a mask's samples, 255 or 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace qdmd {

// Samples of a block that is looked at or left out as a whole.
constexpr int kMaskBlock = 32;

// Copies a mask of kMaskBlock samples, or fewer; whether any sample of it is set.
inline bool copy_if_any(const uint8_t* mask, int count, uint8_t* out) {
  if (count < kMaskBlock) {
    std::memcpy(out, mask, static_cast<size_t>(count));
    return std::memchr(mask, 255, static_cast<size_t>(count)) != nullptr;
  }
  // Eight at a time, which need not go through memory.
  uint64_t any = 0;
  for (int first = 0; first < kMaskBlock; first += 8) {
    uint64_t eight;
    std::memcpy(&eight, mask + first, sizeof eight);
    std::memcpy(out + first, &eight, sizeof eight);
    any |= eight;
  }
  return any != 0;
}

// The first of `count` samples from `from` on that is `colour`, or count.
inline int next_of(const uint8_t* row, int from, int count, uint8_t colour) {
  const void* found = std::memchr(row + from, colour, static_cast<size_t>(count - from));
  return found ? static_cast<int>(static_cast<const uint8_t*>(found) - row) : count;
}

// Begins to bring samples near.
template <typename T>
void fetch(const T* from, int count) {
  constexpr int kLine = 64 / sizeof(T);
  for (int p = 0; p < count; p += kLine) __builtin_prefetch(from + p);
}

inline void either(const uint8_t* __restrict a, const uint8_t* __restrict b,
                   const uint8_t* __restrict c, int count, uint8_t* __restrict out) {
  for (int p = 0; p < count; ++p) out[p] = a[p] | b[p] | c[p];
}

// Whether the mask is set at a sample, or `wide` samples to the left or to the right of it.
inline void widen(const uint8_t* __restrict mask, int count, int wide, uint8_t* __restrict out) {
  for (int p = 0; p < count; ++p) out[p] = mask[p - wide] | mask[p] | mask[p + wide];
}

// Takes what is set in `what` out of the mask; where it was set, sets `taken`, or null.
inline void take_out(const uint8_t* __restrict what, int count, uint8_t* __restrict mask,
                     uint8_t* __restrict taken) {
  if (taken)
    for (int p = 0; p < count; ++p) taken[p] |= what[p] & mask[p];
  for (int p = 0; p < count; ++p) mask[p] = static_cast<uint8_t>(mask[p] & ~what[p]);
}

}  // namespace qdmd
