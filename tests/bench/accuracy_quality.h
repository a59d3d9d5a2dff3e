// SPDX-License-Identifier: LGPL-2.1-or-later
// Background quality, time and memory of every setting on clips with true backgrounds.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "tests/bench/accuracy_table.h"
#include "tests/evaluation/progress.h"

namespace qdmd::bench {

struct TrueClip {
  std::string scenes, name;
  std::vector<cv::Mat> frames;  // 8-bit BGR
  std::vector<cv::Mat> truths;  // one, or one for each frame where it changes
};

// A simulated scene, 25 frames a second.
TrueClip simulated(const std::string& scene, int width, int height, int frames);

struct QualityLimits {
  int turns = 3;
  double seconds = 4;  // processor time after which a slow setting is not repeated
  bool brief = false;
};

// Adds every point of the clip that the table lacks.
void measure_quality(const TrueClip& clip, const QualityLimits& limits, Table* table,
                     evaluation::Progress* progress);

}  // namespace qdmd::bench
