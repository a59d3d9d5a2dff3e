// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/sheet.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "core/metrics/plane.h"
#include "tests/evaluation/clip.h"

namespace qdmd::evaluation {

namespace {

constexpr int kGap = 6, kTitle = 24;  // px
constexpr int kMinWidth = 200;        // of a picture, so that titles fit
constexpr double kErrorGain = 4;

cv::Mat error_picture(const cv::Mat& background, const cv::Mat& truth) {
  Plane<uint8_t> a = luma(view_of(background)), b = luma(view_of(truth));
  cv::Mat difference;
  cv::absdiff(cv::Mat(a.height, a.width, CV_8UC1, a.values.data()),
              cv::Mat(b.height, b.width, CV_8UC1, b.values.data()), difference);
  cv::Mat bright, colour;
  difference.convertTo(bright, CV_8U, kErrorGain);
  cv::cvtColor(bright, colour, cv::COLOR_GRAY2BGR);
  return colour;
}

}  // namespace

cv::Mat contact_sheet(const cv::Mat& input, const cv::Mat& truth,
                      const std::vector<Panel>& panels) {
  std::vector<Panel> top{{"input", input}};
  if (!truth.empty()) top.push_back({"truth", truth});
  const size_t first = top.size();
  top.insert(top.end(), panels.begin(), panels.end());

  const double scale = std::max(1.0, static_cast<double>(kMinWidth) / input.cols);
  const cv::Size size(cvRound(input.cols * scale), cvRound(input.rows * scale));
  const int rows = truth.empty() ? 1 : 2;
  const int columns = static_cast<int>(top.size());
  cv::Mat sheet(kTitle + rows * (size.height + kGap), columns * (size.width + kGap) + kGap, CV_8UC3,
                cv::Scalar::all(255));
  const auto place = [&](const cv::Mat& picture, int x, int y) {
    cv::Mat scaled;
    cv::resize(picture, scaled, size, 0, 0, cv::INTER_LINEAR);
    scaled.copyTo(sheet(cv::Rect({x, y}, size)));
  };
  for (size_t i = 0; i < top.size(); ++i) {
    const int x = kGap + static_cast<int>(i) * (size.width + kGap);
    cv::putText(sheet, top[i].title, {x, kTitle - 7}, cv::FONT_HERSHEY_SIMPLEX, 0.45,
                cv::Scalar::all(0), 1, cv::LINE_AA);
    place(top[i].background, x, kTitle);
    if (rows == 2 && i >= first)
      place(error_picture(top[i].background, truth), x, kTitle + size.height + kGap);
  }
  return sheet;
}

}  // namespace qdmd::evaluation
