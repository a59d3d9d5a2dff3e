// SPDX-License-Identifier: LGPL-2.1-or-later
// Which samples to compare so that the middle ones come to their places, whatever they are: many
// pixels take the same steps side by side.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace qdmd {

// Each step puts the smaller of two samples first. After all steps sample lower_middle() of `count`
// is where sorting would put it, and upper_middle(), too; they are one for odd counts. kMost: of
// samples, a power of two up to 256. Batcher's odd-even merge sort, less the steps that neither of
// them depends on.
template <size_t kMost>
class MedianNetwork {
 public:
  struct Step {
    uint8_t smaller, larger;
  };

  constexpr explicit MedianNetwork(size_t count) : count_(count) {
    for (size_t p = 1; p < count; p *= 2)
      for (size_t k = p; k >= 1; k /= 2)
        for (size_t j = k % p; j + k < count; j += 2 * k)
          for (size_t i = j; i < j + k && i + k < count; ++i)
            if (i / (2 * p) == (i + k) / (2 * p))
              steps_[size_++] = {static_cast<uint8_t>(i), static_cast<uint8_t>(i + k)};
    if (count > 0) drop_needless();
  }

  constexpr size_t lower_middle() const { return (count_ - 1) / 2; }
  constexpr size_t upper_middle() const { return count_ / 2; }
  constexpr const Step* begin() const { return steps_.data(); }
  constexpr const Step* end() const { return steps_.data() + size_; }

 private:
  // The binary logarithm, for the size of a whole sort.
  static constexpr size_t log2(size_t n) { return n > 1 ? 1 + log2(n / 2) : 0; }
  static constexpr size_t kRoom = kMost * (log2(kMost) * log2(kMost) - log2(kMost) + 4) / 4 - 1;

  constexpr void drop_needless() {
    std::array<bool, kMost> needed = {};
    needed[lower_middle()] = needed[upper_middle()] = true;
    size_t kept = size_;
    for (size_t s = size_; s-- > 0;) {
      const Step step = steps_[s];
      if (!needed[step.smaller] && !needed[step.larger]) continue;
      needed[step.smaller] = needed[step.larger] = true;
      steps_[--kept] = step;
    }
    const size_t left = size_ - kept;
    for (size_t s = 0; s < left; ++s) steps_[s] = steps_[kept + s];
    size_ = left;
  }

  size_t count_, size_ = 0;
  std::array<Step, kRoom> steps_ = {};
};

}  // namespace qdmd
