// What is known of a sequence's masks.
#pragma once

#include "core/metrics/mask_scores.h"
#include "tests/evaluation/clip.h"
#include "tests/evaluation/dataset.h"

namespace qdmd::evaluation {

// Scores masks of a clip, which is the whole sequence, by CDnet's rules: frames outside of
// gt/temporalROI.txt and pixels outside of gt/ROI.bmp do not count.
class MaskTruth {
 public:
  // Keeps references.
  MaskTruth(const LabelledClip& clip, const Sequence& sequence);
  // The mask of a frame, counted from 0, in row order. Adds nothing where its truth is not known.
  void add(size_t frame, const uint8_t* mask, MaskCounts* counts) const;

 private:
  const LabelledClip& clip_;
  const Sequence& sequence_;
  cv::Mat inside_;  // empty: all
  size_t first_ = 1, last_ = SIZE_MAX;
};

}  // namespace qdmd::evaluation
