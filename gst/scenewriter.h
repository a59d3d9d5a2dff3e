// SPDX-License-Identifier: LGPL-2.1-or-later
// Writes what a scene has made into packed RGB frames of the same size.
#pragma once

#include <algorithm>
#include <cstring>

#include "core/base/image_view.h"
#include "core/scene/scene.h"

namespace qdmd {

// GStreamer rounds rows of three bytes a pixel up to four: the bytes behind a row become zero, so
// that equal pictures are equal files.
inline void clear_padding(const MutableImageView& view) {
  const ptrdiff_t used = view.width * view.pixel_stride;
  if (view.row_stride - used >= 4 || view.pixel_stride != 3) return;
  uint8_t* first = std::min({view.channel[0], view.channel[1], view.channel[2]});
  for (int y = 0; y < view.height; ++y)
    std::memset(first + y * view.row_stride + used, 0, static_cast<size_t>(view.row_stride - used));
}

// Alpha is opaque.
inline void write_picture(const scene::Picture& picture, const MutableImageView& view) {
  for (int y = 0; y < view.height; ++y) {
    const uint8_t* from = picture.row(y);
    const ptrdiff_t row = y * view.row_stride;
    uint8_t *r = view.channel[0] + row, *g = view.channel[1] + row, *b = view.channel[2] + row;
    if (view.pixel_stride == 3 && g == r + 1 && b == r + 2) {
      std::memcpy(r, from, picture.row_bytes());
      continue;
    }
    const ptrdiff_t step = view.pixel_stride;
    for (int x = 0; x < view.width; ++x)
      r[x * step] = from[3 * x], g[x * step] = from[3 * x + 1], b[x * step] = from[3 * x + 2];
    if (uint8_t* alpha = view.alpha ? view.alpha + row : nullptr)
      for (int x = 0; x < view.width; ++x) alpha[x * step] = 255;
  }
  clear_padding(view);
}

// What a mask and labels are in R, G and B: white where the label is that of an object, else black;
// and the label itself.
inline uint8_t mask_level(uint8_t label) { return label == scene::kObjectLabel ? 255 : 0; }
inline uint8_t label_level(uint8_t label) { return label; }

// Grey of a level that follows from the label.
template <typename LevelOf>
void write_grey(const scene::Plane& labels, const MutableImageView& view, LevelOf level_of) {
  for (int y = 0; y < view.height; ++y) {
    const uint8_t* from = labels.row(y);
    const ptrdiff_t row = y * view.row_stride;
    for (int x = 0; x < view.width; ++x) {
      const ptrdiff_t at = row + x * view.pixel_stride;
      const uint8_t level = level_of(from[x]);
      for (auto* channel : view.channel) channel[at] = level;
      if (view.alpha) view.alpha[at] = 255;
    }
  }
  clear_padding(view);
}

}  // namespace qdmd
