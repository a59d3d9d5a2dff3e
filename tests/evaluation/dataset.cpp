// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/dataset.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <set>

namespace qdmd::evaluation {

namespace fs = std::filesystem;

namespace {

bool is_picture(const fs::path& path) {
  static const std::set<std::string> kinds = {".png", ".jpg",  ".jpeg", ".bmp", ".tif",
                                              ".ppm", ".tiff", ".pgm",  ".webp"};
  std::string kind = path.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return kinds.contains(kind) && path.filename().string().front() != '.';
}

// By name, numbers in it by their value: 2.png comes before 10.png.
bool in_name_order(const fs::path& a, const fs::path& b) {
  const std::string x = a.filename().string(), y = b.filename().string();
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  size_t i = 0, k = 0;
  while (i < x.size() && k < y.size()) {
    if (!is_digit(x[i]) || !is_digit(y[k])) {
      if (x[i] != y[k]) return x[i] < y[k];
      ++i, ++k;
      continue;
    }
    // Without leading zeros the longer number is larger.
    while (i < x.size() && x[i] == '0') ++i;
    while (k < y.size() && y[k] == '0') ++k;
    size_t end_i = i, end_k = k;
    while (end_i < x.size() && is_digit(x[end_i])) ++end_i;
    while (end_k < y.size() && is_digit(y[end_k])) ++end_k;
    if (end_i - i != end_k - k) return end_i - i < end_k - k;
    const int order = x.compare(i, end_i - i, y, k, end_k - k);
    if (order != 0) return order < 0;
    i = end_i, k = end_k;
  }
  return x.size() - i != y.size() - k ? x.size() - i < y.size() - k : x < y;
}

// In name order; empty where there is no such folder. Where it cannot be read, says so in
// `problems`.
std::vector<fs::path> pictures_in(const fs::path& folder, std::vector<std::string>* problems) {
  std::vector<fs::path> found;
  std::error_code error;
  if (!fs::is_directory(folder, error)) return found;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (is_picture(entry->path()) && !entry->is_directory(error)) found.push_back(entry->path());
  if (error)
    problems->push_back(folder.filename().string() + "/ cannot be read: " + error.message());
  std::sort(found.begin(), found.end(), in_name_order);
  return found;
}

// CDnet's name of a mask: "gt" and the frame's number.
bool is_mask_name(const fs::path& path) {
  const std::string stem = path.stem().string();
  return stem.size() > 2 && stem.starts_with("gt") &&
         std::all_of(stem.begin() + 2, stem.end(),
                     [](unsigned char c) { return std::isdigit(c) != 0; });
}

// CDnet's pictures of the region in which masks count.
bool is_region_name(const fs::path& path) { return path.stem() == "ROI"; }

// What CDnet says of the masks that count.
void read_region(Sequence* sequence) {
  for (const char* part : {"", "gt", "GT", "groundtruth"}) {
    const fs::path folder = sequence->folder / part;
    std::error_code error;
    if (fs::is_regular_file(folder / "ROI.bmp", error)) sequence->region = folder / "ROI.bmp";
    std::ifstream frames(folder / "temporalROI.txt");
    uint64_t first = 0, last = 0;
    if (!frames) continue;
    if (frames >> first >> last && first <= last)
      sequence->first_scored = first, sequence->last_scored = last;
    else
      sequence->problems.push_back(
          "temporalROI.txt left out: it has not the numbers of a first and a last frame");
  }
}

// 0 is best.
int truth_order(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with("GT_") ? 0 : name.starts_with("DERIVED_") ? 1 : 2;
}

bool is_sequence(const fs::path& folder) {
  std::error_code error;
  for (const char* part : {"input", "gt", "GT", "groundtruth"})
    if (fs::is_directory(folder / part, error)) return true;
  return false;
}

Sequence read_sequence(const fs::path& folder, const std::string& name) {
  Sequence sequence;
  sequence.name = name;
  sequence.folder = folder;
  sequence.frames = pictures_in(folder / "input", &sequence.problems);
  std::vector<fs::path> truths;
  for (const char* part : {"gt", "GT", "groundtruth"})
    for (const auto& file : pictures_in(folder / part, &sequence.problems)) {
      uint64_t number = 0;
      if (part == std::string("groundtruth") && is_mask_name(file) && frame_number(file, &number))
        sequence.masks[number] = file;
      else if (!is_region_name(file))
        truths.push_back(file);
    }
  for (const auto& file : pictures_in(folder / "gt" / "masks", &sequence.problems)) {
    uint64_t number = 0;
    if (frame_number(file, &number)) sequence.masks[number] = file;
  }
  const auto best = std::min_element(
      truths.begin(), truths.end(),
      [](const fs::path& a, const fs::path& b) { return truth_order(a) < truth_order(b); });
  if (best != truths.end()) sequence.truth = *best;
  read_region(&sequence);

  if (sequence.frames.empty())
    sequence.problems.push_back(fs::is_directory(folder / "input")
                                    ? "no frames: input/ has no pictures"
                                    : "no frames: there is no folder input/");
  else if (sequence.frames.size() == 1)
    sequence.problems.push_back("one frame only: nothing in it can be told apart by motion");
  const bool any_mask = std::any_of(
      sequence.frames.begin(), sequence.frames.end(), [&sequence](const fs::path& frame) {
        uint64_t number = 0;
        return frame_number(frame, &number) && sequence.masks.contains(number) &&
               number >= sequence.first_scored && number <= sequence.last_scored;
      });
  if (!sequence.frames.empty() && !sequence.masks.empty() && !any_mask)
    sequence.problems.push_back(
        "masks left out: none of them has the number of a frame that counts");
  // CDnet has masks and no background pictures: nothing is missing there.
  if (truths.empty() && sequence.masks.empty())
    sequence.problems.push_back(
        "no truth: neither a background picture nor masks in gt/, GT/ or "
        "groundtruth/");
  return sequence;
}

// Sequences in the folders of `folder`; where one of those is none, in its folders.
void collect(const fs::path& folder, const std::string& prefix, int levels,
             std::vector<Sequence>* sequences) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path path = entry->path();
    const std::string name = path.filename().string();
    std::error_code unknown;
    if (!entry->is_directory(unknown) || name.front() == '.') continue;
    if (is_sequence(path))
      sequences->push_back(read_sequence(path, prefix + name));
    else if (levels > 1)
      collect(path, prefix + name + "/", levels - 1, sequences);
  }
  if (!error) return;
  Sequence unreadable;
  unreadable.name = prefix.empty() ? folder.filename().string() : prefix;
  unreadable.folder = folder;
  unreadable.problems.push_back("the folder cannot be read: " + error.message());
  sequences->push_back(std::move(unreadable));
}

}  // namespace

bool frame_number(const fs::path& file, uint64_t* number) {
  const std::string stem = file.stem().string();
  size_t start = stem.size();
  while (start > 0 && std::isdigit(static_cast<unsigned char>(stem[start - 1]))) --start;
  const char* end = stem.data() + stem.size();
  const auto result = std::from_chars(stem.data() + start, end, *number);
  return result.ec == std::errc() && result.ptr == end;
}

std::vector<Sequence> find_sequences(const fs::path& root) {
  const fs::path folder = fs::canonical(root);
  if (is_sequence(folder)) return {read_sequence(folder, folder.filename().string())};
  std::vector<Sequence> sequences;
  collect(folder, "", 2, &sequences);
  std::sort(sequences.begin(), sequences.end(),
            [](const Sequence& a, const Sequence& b) { return a.name < b.name; });
  return sequences;
}

}  // namespace qdmd::evaluation
