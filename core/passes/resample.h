// SPDX-License-Identifier: LGPL-2.1-or-later
// A plane of samples seen from a little beside.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/planes/samples.h"

namespace qdmd {

// Where output pixels are in the picture that they are read from: (x, y) shows
// (x0 + xx x + xy y, y0 + yx x + yy y).
struct Places {
  float xx = 1, xy = 0, x0 = 0, yx = 0, yy = 1, y0 = 0;

  bool is_shift() const { return xx == 1 && xy == 0 && yx == 0 && yy == 1; }
};
// Turns (xy and yx) and growth (xx and yy, less 1) up to this, that is some 3.5 degrees.
constexpr float kMostTurn = 0.06f;

// What a thread needs for it.
class ResampleRoom {
 public:
  ResampleRoom();

 private:
  template <typename T>
  friend class Tiles;
  std::vector<float> columns_;
  std::vector<uint8_t> row_;
  std::vector<uint16_t> deep_row_;
};

struct Resampling {
  Samples from;  // width x height samples, rows without gaps
  int from_width = 0, from_height = 0;
  Places places;
  MutableSamples to;  // rows without gaps
  int width = 0, height = 0;
  int depth = 8;  // bits of a sample
};

// Rows first_row .. first_row + row_count - 1 of `to`, by cubic convolution (the six
// points of Keys 1981), first along rows and then along columns, rounded to whole samples. Output
// pixels that are outside of the picture stay as they are; next to its border it goes on as it
// ends. Any threads may write different rows.
void resample(const Resampling& task, int first_row, int row_count, ResampleRoom* room);

}  // namespace qdmd
