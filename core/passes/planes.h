// SPDX-License-Identifier: LGPL-2.1-or-later
// Packed pixels to planes and back: the streaming passes at both ends of the engine.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/image_view.h"

namespace qdmd {

// Copies the channels of rows first_row .. first_row + row_count - 1 of `frame` into planes of
// width * height samples without gaps, at the same pixels; samples that pixels share to each of
// them. True: every alpha sample of these rows
// is `alpha` (not looked at, and true, where the frame has none).
bool split_channels(const ImageView& frame, int first_row, int row_count, uint8_t alpha,
                    uint8_t* const planes[3]);

// Whether every alpha sample of these rows is `alpha`; true where the frame has none.
bool is_constant_alpha(const ImageView& frame, int first_row, int row_count, uint8_t alpha);

// Writes `count` pixels of one row of `out` from column `left` on. No channel has distances of its
// own. channels: R, G, B; alpha: as
// many samples, read where the format has alpha.
void join_channels(const uint8_t* const channels[3], const uint8_t* alpha, size_t count,
                   const MutableImageView& out, int row, int left);

}  // namespace qdmd
