// SPDX-License-Identifier: LGPL-2.1-or-later
// Samples of 8 to 16 bits as frames are kept in: their highest eight bits, and the bits below.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace qdmd {

// The bytes that a sample of so many bits takes, and the bits below its highest eight.
constexpr int sample_bytes(int depth) { return depth > 8 ? 2 : 1; }
constexpr int bits_below(int depth) { return depth - 8; }

// Samples of one channel, side by side. A sample is high[p] 2^(depth - 8) + low[p].
template <typename Byte>
struct BasicSamples {
  BasicSamples(Byte* high_bits = nullptr, Byte* low_bits = nullptr)  // NOLINT
      : high(high_bits), low(low_bits) {}
  operator BasicSamples<const Byte>() const { return {high, low}; }

  explicit operator bool() const { return high != nullptr; }
  BasicSamples operator+(size_t count) const { return {high + count, low ? low + count : nullptr}; }

  Byte* high;  // null: there are no samples
  Byte* low;   // null: samples have eight bits, or nobody wants more
};
using Samples = BasicSamples<const uint8_t>;
using MutableSamples = BasicSamples<uint8_t>;

inline int sample_at(Samples samples, size_t p, int depth) {
  return samples.low ? samples.high[p] << bits_below(depth) | samples.low[p] : samples.high[p];
}

// Memory for `count` samples, which has so many times sample_bytes(depth) bytes.
template <typename Byte>
BasicSamples<Byte> samples_in(Byte* memory, size_t count, int depth) {
  return {memory, depth > 8 ? memory + count : nullptr};
}

// Copies what both have.
inline void copy_samples(Samples from, size_t count, MutableSamples to) {
  std::copy_n(from.high, count, to.high);
  if (to.low) std::copy_n(from.low, count, to.low);
}

}  // namespace qdmd
