// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/metrics/plane.h"

#include <stdexcept>

namespace qdmd {

namespace {

// Calls see(x, y, R, G, B) for every pixel in row order.
template <typename See>
void each_pixel(const ImageView& picture, See see) {
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const ptrdiff_t offset = y * picture.row_stride + x * picture.pixel_stride;
      see(x, y, int{picture.channel[0][offset]}, int{picture.channel[1][offset]},
          int{picture.channel[2][offset]});
    }
}

}  // namespace

Plane<uint8_t> luma(const ImageView& picture) {
  Plane<uint8_t> out(picture.width, picture.height);
  // In thousandths of a level times 255: integers, so that halves round the same way everywhere.
  each_pixel(picture, [&](int x, int y, int r, int g, int b) {
    const int scaled = 65'481 * r + 128'553 * g + 24'966 * b;
    out.at(x, y) = static_cast<uint8_t>(16 + (scaled + 127'500) / 255'000);
  });
  return out;
}

ReversibleYuv reversible_yuv(const ImageView& picture) {
  const Plane<int> empty(picture.width, picture.height);
  ReversibleYuv out{empty, empty, empty};
  each_pixel(picture, [&](int x, int y, int r, int g, int b) {
    out.y.at(x, y) = (r + 2 * g + b) / 4;
    out.u.at(x, y) = r - g;
    out.v.at(x, y) = b - g;
  });
  return out;
}

void require_same_size(int width, int height, int other_width, int other_height,
                       const std::string& what, const std::string& other) {
  const auto size = [](int w, int h) { return std::to_string(w) + "x" + std::to_string(h); };
  if (width != other_width || height != other_height)
    throw std::invalid_argument(what + " has " + size(width, height) + " pixels, but " + other +
                                " has " + size(other_width, other_height));
  if (width < 1 || height < 1) throw std::invalid_argument(what + " has no pixels");
}

}  // namespace qdmd
