// Pictures of frames whose samples have more than 8 bits.
#pragma once

#include "core/base/levels.h"
#include "core/foreground/foreground.h"

namespace qdmd {

// write_picture() of a task with low digits, for a view of the same depth: L(t), residuals and
// cut-outs have all bits, masks the 256 shades that they have.
void write_deep_picture(const OutputTask& task, const Levels& levels, const MutableImageView& out,
                        int first_row, int row_count);

}  // namespace qdmd
