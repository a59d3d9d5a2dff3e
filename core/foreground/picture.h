// SPDX-License-Identifier: LGPL-2.1-or-later
// The four pictures that users can ask for, in frames of any layout.
#pragma once

#include "core/base/image_view.h"
#include "core/base/levels.h"
#include "core/model/background_model.h"
#include "core/planes/samples.h"

namespace qdmd {

enum class Output {
  background,  // L(t)
  foreground,  // |x - L| per channel
  mask,        // white where Decision says foreground, else black
  // The frame where the mask is white, elsewhere black (transparent with alpha); where the mask is
  // soft, what is in between.
  cutout
};

// One frame of a window and what its pictures are made of. Samples are in row order.
struct OutputTask {
  Samples x[3];                  // the frame's planes
  const BackgroundModel* model;  // at the frame's time
  Output output;
  // Mask and cutout need these: 255 where foreground, else 0, or in between if it is soft; and 255
  // where the mask's picture is to be 127 at least, or null.
  const uint8_t* mask;
  const uint8_t* shaded;
  Samples alpha;            // the frame's own samples, or none where all are
  uint16_t constant_alpha;  // this
  bool soft = false;        // the mask
  // L at that time, if it is already computed, in rows that are `level_stride` samples apart; or
  // none.
  Samples level[3] = {};
  size_t level_stride = 0;
};

// Rows of which some pixels share a sample: 1 or 2.
int rows_together(const MutableImageView& view);

// Writes rows first_row .. first_row + row_count - 1 of the task's picture. A sample that pixels
// share is the mean of what they are, rounded. Greys and residuals are between the levels' black
// and white; black is theirs, too. first_row is a multiple of rows_together(out), and so is
// row_count unless the rows are the last. Any threads may write different rows.
void write_picture(const OutputTask& task, const Levels& levels, const MutableImageView& out,
                   int first_row, int row_count);

}  // namespace qdmd
