// SPDX-License-Identifier: LGPL-2.1-or-later
// Contact sheets: what a sequence's methods made of it, side by side.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace qdmd::evaluation {

struct Panel {
  std::string title;
  cv::Mat background;  // 8-bit BGR
};

// First row: input, truth (where it is not empty) and each panel. Second row: each panel's error
// |Y - Y_truth|, four times as bright, white from 64 levels on. All pictures have one size.
cv::Mat contact_sheet(const cv::Mat& input, const cv::Mat& truth, const std::vector<Panel>& panels);

}  // namespace qdmd::evaluation
