// SPDX-License-Identifier: LGPL-2.1-or-later
// The pictures of a sequence in memory.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/base/image_view.h"
#include "core/metrics/mask_scores.h"
#include "tests/evaluation/dataset.h"

namespace qdmd::evaluation {

// Which frames of a sequence are used: from `start` (0 is the first) every `every`-th one, `frames`
// of them at most (0: all); of those `thin` at most (0: all), evenly spread, and the last one first
// where `reverse`.
struct Selection {
  size_t start = 0, every = 1, frames = 0, thin = 0;
  bool reverse = false;

  std::vector<std::filesystem::path> of(const Sequence& sequence) const;
};

struct LabelledClip {
  std::vector<cv::Mat> frames;  // 8-bit BGR, all of one size
  cv::Mat truth;                // 8-bit BGR of that size; empty: none
  // The masks of frames whose mask counts, 8-bit, pixels outside of the sequence's region
  // MaskLabel::outside; those of others are empty. No elements: no masks.
  std::vector<cv::Mat> labels;
  std::vector<std::string> problems;  // why a truth or masks had to be left out

  // Counts the mask of a frame, which is counted from 0, in row order. Does nothing where no true
  // mask counts.
  void score(size_t frame, const uint8_t* mask, MaskCounts* counts) const;
};

// Throws std::runtime_error that names the file where a frame cannot be read or has another size
// than the first one, and where the selection has no frame.
LabelledClip read_clip(const Sequence& sequence, const Selection& selection);

// The whole sequence; throws std::runtime_error, too, where no mask of it counts.
LabelledClip read_scored_clip(const Sequence& sequence);

// An 8-bit BGR picture of OpenCV for the core.
ImageView view_of(const cv::Mat& bgr);
MutableImageView view_of(cv::Mat& bgr);

}  // namespace qdmd::evaluation
