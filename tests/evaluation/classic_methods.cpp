// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/classic_methods.h"

#include <algorithm>
#include <opencv2/video/background_segm.hpp>
#include <stdexcept>

namespace qdmd::evaluation {

namespace {

class Mean : public Method {
 public:
  Mean() : Method("mean") {}
  Separation separate(const Task& task) const override {
    const Stopwatch watch;
    cv::Mat sum(task.frames[0].size(), CV_64FC3, cv::Scalar::all(0));
    for (const auto& frame : task.frames) cv::add(sum, frame, sum, cv::noArray(), CV_64F);
    Separation result;
    sum.convertTo(result.background, CV_8U, 1.0 / static_cast<double>(task.frames.size()));
    result.seconds = watch.seconds();
    return result;
  }
};

class Median : public Method {
 public:
  Median() : Method("median") {}
  Separation separate(const Task& task) const override {
    const Stopwatch watch;
    Separation result;
    result.background = median_of(task.frames);
    result.seconds = watch.seconds();
    return result;
  }
};

class Subtractor : public Method {
 public:
  using Make = cv::Ptr<cv::BackgroundSubtractor> (*)();
  Subtractor(const char* name, Make make) : Method(name), make_(make) {}

  Separation separate(const Task& task) const override {
    // KNN replaces its samples at random.
    cv::setRNGSeed(1);
    const Stopwatch watch;
    const cv::Ptr<cv::BackgroundSubtractor> subtractor = make_();
    Separation result;
    for (const auto& frame : task.frames) {
      cv::Mat mask;
      subtractor->apply(frame, mask);
      // 127 marks shadows.
      if (task.masks) result.masks.push_back(mask == 255);
    }
    subtractor->getBackgroundImage(result.background);
    result.seconds = watch.seconds();
    // KNN's is empty or black before it has seen enough.
    const auto is_black = [](const cv::Mat& picture) {
      return picture.empty() || cv::countNonZero(picture.reshape(1)) == 0;
    };
    if (is_black(result.background) && !is_black(task.frames.back()))
      throw std::runtime_error("it has learnt no background from so few frames");
    return result;
  }

 private:
  const Make make_;
};

}  // namespace

cv::Mat median_of(const std::vector<cv::Mat>& pictures) {
  const cv::Mat& first = pictures.at(0);
  cv::Mat out(first.size(), CV_8UC3);
  const auto samples = static_cast<size_t>(first.cols) * 3;
  // How often each sample of a row has each of the 256 levels.
  std::vector<uint32_t> counts(samples * 256);
  const auto lower = static_cast<uint32_t>((pictures.size() - 1) / 2);
  const auto upper = static_cast<uint32_t>(pictures.size() / 2);
  for (int y = 0; y < first.rows; ++y) {
    std::fill(counts.begin(), counts.end(), 0);
    for (const auto& picture : pictures) {
      const uint8_t* row = picture.ptr(y);
      for (size_t s = 0; s < samples; ++s) ++counts[s * 256 + row[s]];
    }
    uint8_t* row = out.ptr(y);
    for (size_t s = 0; s < samples; ++s) {
      const uint32_t* count = &counts[s * 256];
      uint32_t below = 0;
      int low = 0, high = 0;
      for (; below + count[low] <= lower; ++low) below += count[low];
      for (high = low; below + count[high] <= upper; ++high) below += count[high];
      row[s] = static_cast<uint8_t>((low + high + 1) / 2);
    }
  }
  return out;
}

Methods classic_methods() {
  Methods methods;
  methods.push_back(std::make_unique<Median>());
  methods.push_back(std::make_unique<Mean>());
  methods.push_back(std::make_unique<Subtractor>("mog2", []() -> cv::Ptr<cv::BackgroundSubtractor> {
    return cv::createBackgroundSubtractorMOG2();
  }));
  methods.push_back(std::make_unique<Subtractor>("knn", []() -> cv::Ptr<cv::BackgroundSubtractor> {
    return cv::createBackgroundSubtractorKNN();
  }));
  return methods;
}

}  // namespace qdmd::evaluation
