// Takes the foreground out of a window: what is no background becomes background.
#pragma once

#include <vector>

#include "core/background/robust/light.h"

namespace qdmd {

// A background picture and how far frames may lie from it; planes of width * height samples.
struct Reference {
  int width = 0, height = 0;
  std::vector<uint8_t> level[kChannels];  // in unit light
  // Quaternion norm in levels: the mean residual of the 5 x 5 pixels around, above which a pixel is
  // foreground.
  std::vector<uint8_t> threshold;
  // What a sample may lie from the background before it is drawn nearer; empty: any distance.
  std::vector<uint8_t> reach;

  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

// Rows first_row .. first_row + row_count - 1 of a frame, in unit light, with the reference's
// levels where the frame is foreground. x: the frame's planes; out: row_count * width samples a
// channel; scratch is resized as needed and can serve many calls.
void fill_rows(const Reference& reference, const uint8_t* const x[3], const Gain& gain,
               int first_row, int row_count, uint8_t* const out[3], std::vector<uint8_t>* scratch);

// The same for every step-th pixel in x and y, judged by its own residual alone: for inner
// products. out: ceil(width / step) * ceil(height / step) samples a channel.
void fill_samples(const Reference& reference, const uint8_t* const x[3], const Gain& gain, int step,
                  uint8_t* const out[3]);

// The frame's gain over the reference by least squares on the sampled pixels that fit it under
// `gain`; `gain` itself where too few do.
Gain refine_gain(const Reference& reference, const uint8_t* const x[3], const Gain& gain, int step);

// out[p] = the mean of the 5 x 5 samples around p; the border's samples stand for those outside.
void blur(const uint8_t* plane, int width, int height, uint8_t* out);

}  // namespace qdmd
