// SPDX-License-Identifier: LGPL-2.1-or-later
// Precision, recall and F-measure of foreground masks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

namespace qdmd {

// Labels of the masks of N. Goyette et al., "changedetection.net: a new change detection benchmark
// dataset" (CDnet, 2012).
enum class MaskLabel : uint8_t {
  background = 0,
  shadow = 50,    // counts as background
  outside = 85,   // of the region of interest: ignored
  unknown = 170,  // edges of moving things: ignored
  foreground = 255
};

// Pixel counts of any number of masks: a sequence is scored by its sums, as in CDnet.
struct MaskCounts {
  uint64_t true_positive = 0, false_positive = 0, false_negative = 0, true_negative = 0;

  // `mask`: a pixel is foreground where not zero. `labels`: values of MaskLabel; another value
  // throws std::invalid_argument and counts nothing.
  void add(const uint8_t* mask, const uint8_t* labels, size_t pixels);

  // The share of the pixels called foreground that is. None where nothing was called so.
  std::optional<double> precision() const;
  // The share of the foreground pixels that was called so. None where there is no foreground.
  std::optional<double> recall() const;
  // 2 precision recall / (precision + recall) = 2 TP / (2 TP + FP + FN). None where nothing is
  // foreground and nothing was called so.
  std::optional<double> f_measure() const;
};

}  // namespace qdmd
