// SPDX-License-Identifier: LGPL-2.1-or-later
// The folders of SBI, SBMnet and CDnet: which sequences there are, and which files they have.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace qdmd::evaluation {

struct Sequence {
  std::string name;  // folder name; below a category as in "basic/511"
  std::filesystem::path folder;
  std::vector<std::filesystem::path> frames;        // of input/, in name order
  std::filesystem::path truth;                      // background picture; empty: none
  std::map<uint64_t, std::filesystem::path> masks;  // by frame number
  std::filesystem::path region;                     // where masks count, not 0; empty: everywhere
  uint64_t first_scored = 0, last_scored = UINT64_MAX;  // frame numbers whose masks count
  std::vector<std::string> problems;                    // what is missing, one sentence each
};

// Layouts, where a folder is called a sequence if it has input/, gt/, GT/ or groundtruth/:
//   truth   gt/GT_*, else gt/DERIVED_*, else the first picture in gt/, GT/ or groundtruth/ that
//           is no mask
//   masks   gt/masks/*, groundtruth/gt<number>.*
//   region  ROI.bmp, and temporalROI.txt with the first and the last frame whose masks count, both
//           beside input/ or in gt/, GT/ or groundtruth/ (CDnet)
// `root` is a sequence itself, or has sequences or folders of sequences. Sorted by name.
std::vector<Sequence> find_sequences(const std::filesystem::path& root);

// The number that ends a file's name without its extension, which tells what mask belongs to what
// frame. False where there is none.
bool frame_number(const std::filesystem::path& file, uint64_t* number);

}  // namespace qdmd::evaluation
