// The pictures that users can ask for, in frames of any layout.
#pragma once

#include "core/base/levels.h"
#include "core/foreground/foreground.h"

namespace qdmd {

// Rows of which some pixels share a sample: 1 or 2.
int rows_together(const MutableImageView& view);

// As write_output(), to views whose channels have distances of their own or whose samples are
// shared, too. A sample is the mean of what its pixels are, rounded. Greys and residuals are
// between the levels' black and white; black is theirs, too. first_row is a multiple of
// rows_together(out), and so is row_count unless the rows are the last.
void write_picture(const OutputTask& task, const Levels& levels, const MutableImageView& out,
                   int first_row, int row_count);

}  // namespace qdmd
