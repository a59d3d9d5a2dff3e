// SPDX-License-Identifier: LGPL-2.1-or-later
// What separates a clip into a background and masks.
#pragma once

#include <chrono>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace qdmd::evaluation {

// Which L(t) is scored. `median`: of each sample over all t.
enum class ScoredPicture { first, middle, last, median };

struct Task {
  const std::vector<cv::Mat>& frames;  // 8-bit BGR, at least one, all of one size
  ScoredPicture picture = ScoredPicture::middle;
  bool masks = false;  // asked for
};

struct Separation {
  cv::Mat background;  // 8-bit BGR
  std::vector<cv::Mat>
      masks;           // one a frame, not zero where foreground; none: not asked or not given
  double seconds = 0;  // wall time from the first frame in memory to the last background
};

class Method {
 public:
  explicit Method(std::string name) : name_(std::move(name)) {}
  virtual ~Method() = default;
  Method(const Method&) = delete;
  Method& operator=(const Method&) = delete;

  const std::string& name() const { return name_; }
  // Called by several threads at once. Throws std::runtime_error with a sentence for the user.
  virtual Separation separate(const Task& task) const = 0;

 private:
  const std::string name_;
};

using Methods = std::vector<std::unique_ptr<Method>>;

// Index of the frame whose L(t) is scored; the middle one where that is the median.
inline size_t scored_frame(ScoredPicture picture, size_t frames) {
  if (picture == ScoredPicture::first) return 0;
  return picture == ScoredPicture::last ? frames - 1 : (frames - 1) / 2;
}

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace qdmd::evaluation
