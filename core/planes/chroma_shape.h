// SPDX-License-Identifier: LGPL-2.1-or-later
// Which pixels of a picture share samples of chroma.
#pragma once

#include <cstddef>

namespace qdmd {

// Pictures in which no, two neighbouring or 2 x 2 pixels share each sample of channels 1 and 2;
// fewer do at the right and lower edges of odd sizes.
struct ChromaShape {
  int width = 0, height = 0;  // pixels
  int columns = 1, rows = 1;  // of pixels that share a sample; rows is 1 where columns is

  bool is_shared() const { return columns > 1; }
  int chroma_width() const { return (width + columns - 1) / columns; }
  int chroma_height() const { return (height + rows - 1) / rows; }
  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  // How many samples channel 1 or 2 has.
  size_t samples() const {
    return static_cast<size_t>(chroma_width()) * static_cast<size_t>(chroma_height());
  }
};

}  // namespace qdmd
