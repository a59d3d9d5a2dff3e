#include "tests/evaluation/dataset.h"

#include <algorithm>
#include <cctype>
#include <charconv>
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

// Sorted by name; empty where there is no such folder.
std::vector<fs::path> pictures_in(const fs::path& folder) {
  std::vector<fs::path> found;
  if (!fs::is_directory(folder)) return found;
  for (const auto& entry : fs::directory_iterator(folder))
    if (is_picture(entry.path()) && !entry.is_directory()) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

// CDnet's name of a mask: "gt" and the frame's number.
bool is_mask_name(const fs::path& path) {
  const std::string stem = path.stem().string();
  return stem.size() > 2 && stem.starts_with("gt") &&
         std::all_of(stem.begin() + 2, stem.end(),
                     [](unsigned char c) { return std::isdigit(c) != 0; });
}

// 0 is best.
int truth_order(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with("GT_") ? 0 : name.starts_with("DERIVED_") ? 1 : 2;
}

bool is_sequence(const fs::path& folder) {
  for (const char* part : {"input", "gt", "GT", "groundtruth"})
    if (fs::is_directory(folder / part)) return true;
  return false;
}

Sequence read_sequence(const fs::path& folder, const std::string& name) {
  Sequence sequence;
  sequence.name = name;
  sequence.folder = folder;
  sequence.frames = pictures_in(folder / "input");
  std::vector<fs::path> truths;
  for (const char* part : {"gt", "GT", "groundtruth"})
    for (const auto& file : pictures_in(folder / part)) {
      uint64_t number = 0;
      if (is_mask_name(file) && frame_number(file, &number))
        sequence.masks[number] = file;
      else
        truths.push_back(file);
    }
  for (const auto& file : pictures_in(folder / "gt" / "masks")) {
    uint64_t number = 0;
    if (frame_number(file, &number)) sequence.masks[number] = file;
  }
  const auto best = std::min_element(
      truths.begin(), truths.end(),
      [](const fs::path& a, const fs::path& b) { return truth_order(a) < truth_order(b); });
  if (best != truths.end()) sequence.truth = *best;

  if (sequence.frames.empty())
    sequence.problems.push_back(fs::is_directory(folder / "input")
                                    ? "no frames: input/ has no pictures"
                                    : "no frames: there is no folder input/");
  else if (sequence.frames.size() == 1)
    sequence.problems.push_back("one frame only: nothing in it can be told apart by motion");
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
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!entry.is_directory() || name.front() == '.') continue;
    if (is_sequence(entry.path()))
      sequences->push_back(read_sequence(entry.path(), prefix + name));
    else if (levels > 1)
      collect(entry.path(), prefix + name + "/", levels - 1, sequences);
  }
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
