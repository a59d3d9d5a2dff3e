// SPDX-License-Identifier: LGPL-2.1-or-later
// 8-bit pictures and planes that own their samples, rows without padding.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace qdmd::scene {

template <int kSamples>
struct Raster {
  static constexpr int kSamplesPerPixel = kSamples;
  int width = 0, height = 0;
  std::vector<uint8_t> samples;  // width x height x kSamples, a pixel's samples side by side

  Raster() = default;
  Raster(int width_, int height_) { resize(width_, height_); }

  // Leaves samples as they come.
  void resize(int width_, int height_) {
    width = width_, height = height_;
    samples.resize(static_cast<size_t>(width) * static_cast<size_t>(height) * kSamples);
  }

  size_t row_bytes() const { return static_cast<size_t>(width) * kSamples; }
  uint8_t* row(int y) { return samples.data() + static_cast<size_t>(y) * row_bytes(); }
  const uint8_t* row(int y) const { return samples.data() + static_cast<size_t>(y) * row_bytes(); }
  uint8_t* at(int x, int y) { return row(y) + static_cast<ptrdiff_t>(x) * kSamples; }
  const uint8_t* at(int x, int y) const { return row(y) + static_cast<ptrdiff_t>(x) * kSamples; }
  void fill(uint8_t value) { std::fill(samples.begin(), samples.end(), value); }
};

using Picture = Raster<3>;  // R, G, B
using Plane = Raster<1>;
using Colour = std::array<uint8_t, 3>;

inline uint8_t to_level(double value) {
  return static_cast<uint8_t>(std::clamp(value, 0.0, 255.0) + 0.5);
}

// A rectangle of pixels. May be empty.
struct Box {
  int x = 0, y = 0, width = 0, height = 0;

  bool empty() const { return width <= 0 || height <= 0; }
  int right() const { return x + width; }
  int bottom() const { return y + height; }
  bool operator==(const Box&) const = default;
};

inline Box intersection(const Box& a, const Box& b) {
  const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  const int width = std::min(a.right(), b.right()) - x;
  const int height = std::min(a.bottom(), b.bottom()) - y;
  return width > 0 && height > 0 ? Box{x, y, width, height} : Box{};
}

}  // namespace qdmd::scene
