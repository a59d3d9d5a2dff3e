// Foreground statistics of a solved window, and the four pictures that users can ask for.
#pragma once

#include "core/base/image_view.h"
#include "core/foreground/ignored.h"
#include "core/model/background_model.h"
#include "core/parallel/band.h"
#include "core/parallel/pool.h"

namespace qdmd {

enum class Output {
  background,  // L(t)
  foreground,  // |x - L| per channel
  mask,        // white where Decision says foreground, else black
  // The frame where the mask is white, elsewhere black (transparent with alpha); where the mask is
  // soft, what is in between.
  cutout
};

struct ForegroundStatistics {
  double noise = 0;      // standard deviation of one channel, grey levels
  double threshold = 0;  // quaternion norm in grey levels above which a pixel is foreground
  double ratio = 0;      // share of the sampled pixels above it and their own limits, 0 .. 1
};

// The threshold that suits a noise level: max(4 sqrt(3) sigma, 18) grey levels of quaternion norm.
double automatic_threshold(double noise);

// Looks at a sample of the window's residuals |x_t - L(t)| (quaternion norm). The noise comes from
// their lower quartile, which a foreground of up to three quarters of the pixels cannot move much:
// for Gaussian noise it is 1.1012 sigma (chi distribution, 3 degrees of freedom). The threshold is
// `fixed_threshold`, or, where that is 0, the automatic one and the model's limits.
// Leaves the model's time at the last sampled snapshot. Pixels of snapshots, `width` wide, that are
// ignored say nothing. band: which rows of the pictures the snapshots have; by default all.
ForegroundStatistics foreground_statistics(const SnapshotRange& snapshots, BackgroundModel& model,
                                           double fixed_threshold, Pool& pool,
                                           const IgnoredAreas& ignored = {}, int width = 1,
                                           const Band& band = {});

// One frame of a window and what its pictures are made of.
struct OutputTask {
  const uint8_t* x[3];           // the frame's planes
  const BackgroundModel* model;  // at the frame's time
  Output output;
  // Of mask and cutout: 255 where foreground, else 0, or in between if it is soft; and 255 where
  // the mask's picture is to be 127 at least, or null.
  const uint8_t* mask;
  const uint8_t* shaded;
  const uint8_t* alpha;    // the frame's own samples in row order, or null where all are
  uint8_t constant_alpha;  // this
  bool soft = false;       // the mask
  // Samples of black.
  uint8_t black[3] = {0, 0, 0};
  // L at that time, if it is already computed, in rows that are `level_stride` samples apart; or
  // nulls.
  const uint8_t* level[3] = {nullptr, nullptr, nullptr};
  size_t level_stride = 0;
  // Of samples of more than 8 bits what is below the highest 8, of x, `level` and alpha; else
  // nulls.
  const uint8_t* low[3] = {nullptr, nullptr, nullptr};
  const uint8_t* level_low[3] = {nullptr, nullptr, nullptr};  // as `level`
  const uint8_t* alpha_low = nullptr;
  uint8_t constant_alpha_low = 0;

  // L of pixels left .. left + count - 1 of a row that is `width` pixels wide. It is computed into
  // `room` unless `level` has it.
  void find_level(size_t y, size_t left, size_t count, size_t width, uint8_t* const room[3],
                  const uint8_t* out[3]) const {
    if (!level[0]) model->evaluate(y * width + left, count, room);
    for (int c = 0; c < kChannels; ++c)
      out[c] = level[0] ? level[c] + y * level_stride + left : room[c];
  }
};

// Writes rows first_row .. first_row + row_count - 1 of the task's picture. Any threads may write
// different rows.
void write_output(const OutputTask& task, const MutableImageView& out, int first_row,
                  int row_count);

}  // namespace qdmd
