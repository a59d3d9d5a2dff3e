// SPDX-License-Identifier: LGPL-2.1-or-later
// Background models to compare with: mean, median, and OpenCV's MOG2 and KNN.
#pragma once

#include "tests/evaluation/method.h"

namespace qdmd::evaluation {

// median and mean look at all frames. mog2 and knn learn frame by frame with OpenCV's defaults
// (shadows do not count as foreground), so whichever picture is asked for, theirs is the background
// after the last frame, when they have seen as much as the others.
Methods classic_methods();

// Each sample's median over all pictures; between two middle values their mean, rounded up.
cv::Mat median_of(const std::vector<cv::Mat>& pictures);

}  // namespace qdmd::evaluation
