// SPDX-License-Identifier: LGPL-2.1-or-later
// An engine fed from clips, and packed pictures with strides, padding and alpha.
#pragma once

#include "core/engine/engine.h"
#include "tests/core/test_util.h"

namespace qdmd::test {

inline constexpr uint8_t kUntouched = 0xA5;

// A packed picture of its own. bytes_per_pixel 4 has alpha at offset 3 when `with_alpha`.
struct PackedPicture {
  int width, height, bytes_per_pixel;
  bool with_alpha;
  ptrdiff_t row_stride;
  std::vector<uint8_t> bytes;

  PackedPicture(int width_, int height_, int bytes_per_pixel_ = 4, bool with_alpha_ = false,
                int padding = 0)
      : width(width_),
        height(height_),
        bytes_per_pixel(bytes_per_pixel_),
        with_alpha(with_alpha_),
        row_stride(width_ * bytes_per_pixel_ + padding),
        bytes(static_cast<size_t>(row_stride * height_), kUntouched) {}

  uint8_t& at(size_t channel, size_t pixel) {
    const size_t row = pixel / static_cast<size_t>(width), col = pixel % static_cast<size_t>(width);
    return bytes[row * static_cast<size_t>(row_stride) +
                 col * static_cast<size_t>(bytes_per_pixel) + channel];
  }
  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }

  template <typename Byte>
  BasicImageView<Byte> view() {
    BasicImageView<Byte> view;
    for (int c = 0; c < 3; ++c) view.channel[c] = bytes.data() + c;
    if (with_alpha) view.alpha = bytes.data() + 3;
    view.width = width;
    view.height = height;
    view.pixel_stride = bytes_per_pixel;
    view.row_stride = row_stride;
    return view;
  }
  ImageView in() { return view<const uint8_t>(); }
  MutableImageView out() { return view<uint8_t>(); }

  void fill(const std::vector<uint8_t>& planes) {
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels(); ++p) at(c, p) = planes[c * pixels() + p];
  }
  std::vector<uint8_t> planes() {
    std::vector<uint8_t> planes(3 * pixels());
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels(); ++p) planes[c * pixels() + p] = at(c, p);
    return planes;
  }
};

// What options and a size come to.
inline EngineLayout layout_of(const EngineOptions& options, int width, int height) {
  return EnginePlan(options, width, height).layout();
}
inline Status check_options(const EngineOptions& options, int width, int height) {
  return EnginePlan(options, width, height).status();
}

// An engine for pictures of width x 1.
struct Strip {
  int width;
  Engine engine;
  Wishes wishes;  // of each call

  Strip(size_t pixels, const EngineOptions& options)
      : width(static_cast<int>(pixels)), wishes(first_wishes(options)) {
    const Status status = engine.configure(options, width, 1);
    EXPECT_TRUE(status.ok()) << status.message;
  }
  Status push(const std::vector<uint8_t>& planes) {
    PackedPicture picture(width, 1);
    picture.fill(planes);
    return engine.push(picture.in(), &wishes);
  }
  std::vector<uint8_t> pop(Output output) {
    PackedPicture picture(width, 1);
    engine.next(&wishes)->pop(output, picture.out());
    return picture.planes();
  }
  // Pops all that is ready.
  std::vector<std::vector<uint8_t>> pop_all(Output output) {
    std::vector<std::vector<uint8_t>> all;
    while (engine.next()) all.push_back(pop(output));
    return all;
  }
  // The whole stream, drained at its end.
  std::vector<std::vector<uint8_t>> run(const Clip& clip, Output output) {
    std::vector<std::vector<uint8_t>> all;
    const auto take = [&] {
      for (auto& picture : pop_all(output)) all.push_back(std::move(picture));
    };
    for (const auto& frame : clip.frames) {
      EXPECT_TRUE(push(frame).ok());
      take();
    }
    EXPECT_TRUE(engine.drain().ok());
    take();
    return all;
  }
};

// Options of plain Q-DMD: what it gives can be said exactly. robust_of() has the default method.
inline EngineOptions window_of(int size) {
  EngineOptions options;
  options.method = Method::qdmd;
  options.window_size = size;
  return options;
}

// The options with masks in which each pixel decides by itself.
inline EngineOptions with_pixels_alone(EngineOptions options) {
  options.steps = {false, false, false, false, false, false};
  return options;
}

}  // namespace qdmd::test
