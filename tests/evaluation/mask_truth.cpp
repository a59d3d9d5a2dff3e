#include "tests/evaluation/mask_truth.h"

#include <fstream>
#include <opencv2/imgcodecs.hpp>

namespace qdmd::evaluation {

MaskTruth::MaskTruth(const LabelledClip& clip, const Sequence& sequence)
    : clip_(clip), sequence_(sequence) {
  const auto region = sequence.folder / "gt/ROI.bmp";
  if (std::filesystem::exists(region)) inside_ = cv::imread(region.string(), cv::IMREAD_GRAYSCALE);
  std::ifstream frames(sequence.folder / "gt/temporalROI.txt");
  if (!(frames >> first_ >> last_)) first_ = 1, last_ = SIZE_MAX;
}

void MaskTruth::add(size_t frame, const uint8_t* mask, MaskCounts* counts) const {
  if (frame >= clip_.labels.size() || clip_.labels[frame].empty()) return;
  uint64_t number = frame + 1;
  frame_number(sequence_.frames[frame], &number);
  if (number < first_ || number > last_) return;
  cv::Mat labels = clip_.labels[frame].clone();
  if (!inside_.empty()) labels.setTo(static_cast<double>(MaskLabel::outside), inside_ == 0);
  counts->add(mask, labels.data, labels.total());
}

}  // namespace qdmd::evaluation
