// SPDX-License-Identifier: LGPL-2.1-or-later
// Keeps of all L(t) the one that is scored.
#pragma once

#include "tests/evaluation/classic_methods.h"
#include "tests/evaluation/method.h"

namespace qdmd::evaluation {

class BackgroundTaker {
 public:
  BackgroundTaker(ScoredPicture picture, size_t frames)
      : picture_(picture), scored_(scored_frame(picture, frames)) {}

  // The next L(t); the caller may change its pixels afterwards.
  void take(const cv::Mat& background) {
    if (picture_ == ScoredPicture::median || count_ == scored_) kept_.push_back(background.clone());
    ++count_;
  }
  size_t count() const { return count_; }
  // Empty where the scored frame has not come.
  cv::Mat result() const {
    if (kept_.empty()) return {};
    return picture_ == ScoredPicture::median ? median_of(kept_) : kept_[0];
  }

 private:
  const ScoredPicture picture_;
  const size_t scored_;
  size_t count_ = 0;
  std::vector<cv::Mat> kept_;
};

}  // namespace qdmd::evaluation
