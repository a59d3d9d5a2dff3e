// SPDX-License-Identifier: LGPL-2.1-or-later
// GStreamer's own element, `segmentation`, among the peers.
#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <vector>

namespace qdmd::bench {

// Sends a clip through `segmentation method=mog2`: RGBA in, painted RGBA out, each frame copied
// into a buffer as a decoder would. Nothing where GStreamer does not have the element. It shows no
// background: its time is all there is.
std::function<void()> segmentation_of(const std::vector<cv::Mat>& frames);

}  // namespace qdmd::bench
