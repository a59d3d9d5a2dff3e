// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/clip.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "examples/archive/picture_file.h"

namespace qdmd::evaluation {

namespace fs = std::filesystem;

namespace {

std::string size_text(const cv::Mat& picture) {
  return std::to_string(picture.cols) + "x" + std::to_string(picture.rows);
}

cv::Mat read_picture(const fs::path& path, int flags, const fs::path& folder) {
  std::ifstream file(path, std::ios::binary);
  if (archive::is_cut_off(std::string{std::istreambuf_iterator<char>(file), {}}))
    throw std::runtime_error("cannot read " + fs::relative(path, folder).string() +
                             ", which is cut off");
  cv::Mat picture;
  try {
    picture = cv::imread(path.string(), flags);
  } catch (const cv::Exception&) {
    // An empty picture, as for any other unreadable file.
  }
  if (picture.empty())
    throw std::runtime_error("cannot read " + fs::relative(path, folder).string());
  return picture;
}

void require_size(const cv::Mat& picture, const fs::path& path, const cv::Mat& first,
                  const fs::path& first_path, const fs::path& folder) {
  if (picture.size() != first.size())
    throw std::runtime_error(
        "two sizes: " + fs::relative(path, folder).string() + " has " + size_text(picture) +
        " pixels, " + fs::relative(first_path, folder).string() + " has " + size_text(first));
}

void read_labels(const Sequence& sequence, const std::vector<fs::path>& paths, LabelledClip* clip) {
  std::vector<cv::Mat> labels(paths.size());
  bool any = false;
  cv::Mat region;
  if (!sequence.region.empty()) {
    region = read_picture(sequence.region, cv::IMREAD_GRAYSCALE, sequence.folder);
    require_size(region, sequence.region, clip->frames[0], paths[0], sequence.folder);
  }
  for (size_t i = 0; i < paths.size(); ++i) {
    uint64_t number = 0;
    if (!frame_number(paths[i], &number) || !sequence.masks.contains(number) ||
        number < sequence.first_scored || number > sequence.last_scored)
      continue;
    const fs::path& path = sequence.masks.at(number);
    labels[i] = read_picture(path, cv::IMREAD_GRAYSCALE, sequence.folder);
    require_size(labels[i], path, clip->frames[0], paths[0], sequence.folder);
    try {
      MaskCounts().add(labels[i].data, labels[i].data, labels[i].total());
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(fs::relative(path, sequence.folder).string() + ": " + error.what());
    }
    if (!region.empty()) labels[i].setTo(static_cast<double>(MaskLabel::outside), region == 0);
    any = true;
  }
  if (any) clip->labels = std::move(labels);
}

template <typename Byte>
BasicImageView<Byte> bgr_view(const cv::Mat& bgr) {
  BasicImageView<Byte> view;
  for (int c = 0; c < 3; ++c) view.channel[c] = bgr.data + 2 - c;
  view.width = bgr.cols;
  view.height = bgr.rows;
  view.pixel_stride = 3;
  view.row_stride = static_cast<ptrdiff_t>(bgr.step[0]);
  return view;
}

}  // namespace

std::vector<fs::path> Selection::of(const Sequence& sequence) const {
  std::vector<fs::path> chosen;
  for (size_t i = start; i < sequence.frames.size() && (frames == 0 || chosen.size() < frames);
       i += every)
    chosen.push_back(sequence.frames[i]);
  if (thin > 0 && chosen.size() > thin) {
    const size_t count = chosen.size();
    for (size_t i = 0; i < thin; ++i) chosen[i] = chosen[i * count / thin];
    chosen.resize(thin);
  }
  if (reverse) std::reverse(chosen.begin(), chosen.end());
  return chosen;
}

void LabelledClip::score(size_t frame, const uint8_t* mask, MaskCounts* counts) const {
  if (frame >= labels.size() || labels[frame].empty()) return;
  counts->add(mask, labels[frame].data, labels[frame].total());
}

LabelledClip read_clip(const Sequence& sequence, const Selection& selection) {
  const std::vector<fs::path> paths = selection.of(sequence);
  if (paths.empty())
    throw std::runtime_error("no frames are left: the sequence has " +
                             std::to_string(sequence.frames.size()));
  LabelledClip clip;
  for (const auto& path : paths) {
    clip.frames.push_back(read_picture(path, cv::IMREAD_COLOR, sequence.folder));
    require_size(clip.frames.back(), path, clip.frames[0], paths[0], sequence.folder);
  }
  try {
    if (!sequence.truth.empty()) {
      const cv::Mat truth = read_picture(sequence.truth, cv::IMREAD_COLOR, sequence.folder);
      require_size(truth, sequence.truth, clip.frames[0], paths[0], sequence.folder);
      clip.truth = truth;
    }
  } catch (const std::runtime_error& error) {
    clip.problems.push_back(std::string("truth left out, ") + error.what());
  }
  try {
    read_labels(sequence, paths, &clip);
  } catch (const std::runtime_error& error) {
    clip.problems.push_back(std::string("masks left out, ") + error.what());
  }
  return clip;
}

LabelledClip read_scored_clip(const Sequence& sequence) {
  LabelledClip clip = read_clip(sequence, {});
  if (clip.labels.empty())
    throw std::runtime_error(sequence.name + ": " +
                             (clip.problems.empty() ? "no mask counts" : clip.problems.back()));
  return clip;
}

ImageView view_of(const cv::Mat& bgr) { return bgr_view<const uint8_t>(bgr); }
MutableImageView view_of(cv::Mat& bgr) { return bgr_view<uint8_t>(bgr); }

}  // namespace qdmd::evaluation
