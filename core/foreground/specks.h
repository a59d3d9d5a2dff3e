// SPDX-License-Identifier: LGPL-2.1-or-later
// Specks and holes of a mask: parts that are too small to be anything.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace qdmd {

// Looks at one mask after another, with the same memory.
class Specks {
 public:
  // Takes all memory. For masks of width x height pixels.
  Specks(int width, int height);
  static uint64_t bytes(int width, int height);

  // Parts of `mask` (width * height samples, 255 or 0) that are `colour`, one of the two, and have
  // fewer than `least` pixels become the other. diagonal: pixels that touch at a corner are one
  // part. A mask with more parts than anything real has, a run of pixels for every 16, stays as it
  // is: false.
  bool take_out(uint8_t* mask, uint8_t colour, size_t least, bool diagonal);

 private:
  // Pixels begin .. end - 1 of a row. part: another run of its part, itself where it stands for all
  // (parts.h); the part's pixels are then known of that.
  struct Run {
    int begin, end;
    uint32_t part, area;
  };

  size_t width_, height_, most_runs_;
  std::vector<Run> runs_;
  std::vector<uint32_t> rows_;  // where each row's runs begin
};

}  // namespace qdmd
