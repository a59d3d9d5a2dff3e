// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames as a smaller picture that masks are found in.
#pragma once

#include <cstdint>
#include <memory>

#include "core/base/image_view.h"
#include "core/base/reduction.h"
#include "core/parallel/pool.h"

namespace qdmd {

// Means of 2 x 2 samples of each channel, halves rounded up, and for scale 4 the means of these;
// where a row or column has no other beside it, of what there is. Pixels share samples of chroma as
// those of the frames do.
class FrameReducer {
 public:
  // For frames of that size, whose samples have `depth` bits. Takes all memory, whose pages are
  // touched by reduce().
  FrameReducer(const Reduction& size, int depth);
  static uint64_t bytes(const Reduction& size, int depth);

  // The smaller picture, with alpha if the frame has some. Good until the next call. pool may be
  // null.
  ImageView reduce(const ImageView& frame, Pool* pool);

 private:
  uint8_t* plane(size_t channel) { return planes_.get() + channel * plane_bytes(size_, depth_); }
  static size_t plane_bytes(const Reduction& size, int depth);

  Reduction size_;
  int depth_;
  std::unique_ptr<uint8_t[]> planes_;
};

}  // namespace qdmd
