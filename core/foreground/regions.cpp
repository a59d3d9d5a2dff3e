#include "core/foreground/regions.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <opencv2/imgproc.hpp>

namespace qdmd {
namespace {

bool overlap(const Region& a, const Region& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

Region merged(const Region& a, const Region& b) {
  Region both;
  both.x = std::min(a.x, b.x);
  both.y = std::min(a.y, b.y);
  both.width = std::max(a.x + a.width, b.x + b.width) - both.x;
  both.height = std::max(a.y + a.height, b.y + b.height) - both.y;
  both.area = a.area + b.area;
  both.mean_residual = (a.area * a.mean_residual + b.area * b.mean_residual) / both.area;
  return both;
}

// Each region swallows those that it overlaps, until none does.
void merge_overlapping(std::vector<Region>* regions) {
  for (size_t i = 0; i < regions->size();) {
    const auto other =
        std::find_if(regions->begin() + static_cast<ptrdiff_t>(i) + 1, regions->end(),
                     [&](const Region& r) { return overlap((*regions)[i], r); });
    if (other == regions->end()) {
      ++i;
      continue;
    }
    (*regions)[i] = merged((*regions)[i], *other);
    regions->erase(other);
    // It has grown: those before may overlap it now.
    i = 0;
  }
}

// Gives parts of `white` that are near to each other one label; returns the number of labels.
// OpenCV's words for memory that runs out become those of the language.
int label_parts(const cv::Mat& white, cv::Mat* joined, cv::Mat* labels) try {
  const int gap =
      std::max(1, static_cast<int>(std::lround(std::min(white.cols, white.rows) / 120.0)));
  cv::dilate(white, *joined, cv::getStructuringElement(cv::MORPH_RECT, {2 * gap + 1, 2 * gap + 1}));
  return cv::connectedComponents(*joined, *labels, 8, CV_32S);
} catch (const cv::Exception& error) {
  if (error.code == cv::Error::StsNoMem) throw std::bad_alloc();
  throw;
}

// Of the pixels with one label.
struct Sum {
  int left = INT32_MAX, top = INT32_MAX, right = -1, bottom = -1, area = 0;
  int64_t residual = 0;
};

}  // namespace

struct RegionFinder::Memory {
  cv::Mat joined, labels;
  std::vector<Sum> sums;  // a label's at its number
  std::vector<Region> regions;
};

RegionFinder::RegionFinder() = default;
RegionFinder::RegionFinder(RegionFinder&&) noexcept = default;
RegionFinder& RegionFinder::operator=(RegionFinder&&) noexcept = default;
RegionFinder::~RegionFinder() = default;

const std::vector<Region>& RegionFinder::find(const uint8_t* mask, const uint8_t* residual,
                                              int width, int height, int least_area) {
  if (!memory_) memory_ = std::make_unique<Memory>();
  auto& [joined, labels, sums, regions] = *memory_;
  // OpenCV has no const pictures.
  const cv::Mat white(height, width, CV_8UC1, const_cast<uint8_t*>(mask));
  const int count = label_parts(white, &joined, &labels);

  sums.assign(static_cast<size_t>(count), {});
  for (int y = 0; y < height; ++y) {
    const int* label = labels.ptr<int>(y);
    const uint8_t* inside = white.ptr<uint8_t>(y);
    const uint8_t* levels = residual + static_cast<ptrdiff_t>(y) * width;
    for (int x = 0; x < width; ++x) {
      if (!inside[x]) continue;
      Sum& sum = sums[static_cast<size_t>(label[x])];
      sum.left = std::min(sum.left, x);
      sum.right = std::max(sum.right, x);
      sum.top = std::min(sum.top, y);
      sum.bottom = y;
      ++sum.area;
      sum.residual += levels[x];
    }
  }
  const double least =
      least_area > 0 ? least_area : std::max(4.0, static_cast<double>(width) * height / 2000);
  regions.clear();
  for (const Sum& sum : sums)
    if (sum.area > 0 && sum.area >= least)
      regions.push_back({sum.left, sum.top, sum.right - sum.left + 1, sum.bottom - sum.top + 1,
                         sum.area, static_cast<double>(sum.residual) / sum.area});
  std::sort(regions.begin(), regions.end(),
            [](const Region& a, const Region& b) { return a.area > b.area; });
  if (regions.size() > kMostRegions) regions.resize(kMostRegions);
  merge_overlapping(&regions);
  std::sort(regions.begin(), regions.end(),
            [](const Region& a, const Region& b) { return a.area > b.area; });
  return regions;
}

}  // namespace qdmd
