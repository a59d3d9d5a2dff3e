// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/metrics/mask_scores.h"

#include <stdexcept>
#include <string>

namespace qdmd {

namespace {

std::optional<double> ratio(uint64_t part, uint64_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void MaskCounts::add(const uint8_t* mask, const uint8_t* labels, size_t pixels) {
  MaskCounts sum = *this;
  for (size_t i = 0; i < pixels; ++i) {
    const bool called_foreground = mask[i] != 0;
    switch (MaskLabel{labels[i]}) {
      case MaskLabel::foreground:
        ++(called_foreground ? sum.true_positive : sum.false_negative);
        break;
      case MaskLabel::background:
      case MaskLabel::shadow:
        ++(called_foreground ? sum.false_positive : sum.true_negative);
        break;
      case MaskLabel::outside:
      case MaskLabel::unknown:
        break;
      default:
        throw std::invalid_argument("label " + std::to_string(labels[i]) +
                                    " is none of 0, 50, 85, 170 and 255");
    }
  }
  *this = sum;
}

std::optional<double> MaskCounts::precision() const {
  return ratio(true_positive, true_positive + false_positive);
}
std::optional<double> MaskCounts::recall() const {
  return ratio(true_positive, true_positive + false_negative);
}
std::optional<double> MaskCounts::f_measure() const {
  return ratio(2 * true_positive, 2 * true_positive + false_positive + false_negative);
}

}  // namespace qdmd
