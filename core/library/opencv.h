// The engine with the interface of OpenCV's background subtractors. Needs OpenCV's headers.
#pragma once

#include <opencv2/video/background_segm.hpp>

#include "separator.h"

namespace qdmd::library {

// In place of cv::createBackgroundSubtractorMOG2(): pictures are CV_8UC3 (BGR). A learning rate of
// 0 keeps the background as it is; every other one means what the options say.
class BackgroundSubtractor : public cv::BackgroundSubtractor {
 public:
  explicit BackgroundSubtractor(const Options& options = {}) : separator_(options) {}

  void apply(cv::InputArray image, cv::OutputArray mask, double learning_rate = -1) override {
    const cv::Mat frame = image.getMat();
    CV_Assert(frame.type() == CV_8UC3);
    mask.create(frame.size(), CV_8UC1);
    cv::Mat out = mask.getMat();
    size_ = frame.size();
    separator_.freeze(learning_rate == 0);
    separator_.apply(frame.data, layout(frame), out.data, static_cast<ptrdiff_t>(out.step));
  }

  // Empty where no frame was applied yet.
  void getBackgroundImage(cv::OutputArray background) const override {
    if (size_.empty()) {
      background.release();
      return;
    }
    background.create(size_, CV_8UC3);
    cv::Mat out = background.getMat();
    separator_.background(layout(out), out.data);
  }

 private:
  static Layout layout(const cv::Mat& picture) {
    return {picture.cols, picture.rows, static_cast<ptrdiff_t>(picture.step), true};
  }

  mutable Separator separator_;  // waits for the solve that is under way
  cv::Size size_;
};

inline cv::Ptr<cv::BackgroundSubtractor> create_background_subtractor(const Options& options = {}) {
  return cv::makePtr<BackgroundSubtractor>(options);
}

}  // namespace qdmd::library
