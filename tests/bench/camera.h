// SPDX-License-Identifier: LGPL-2.1-or-later
// A camera that costs about as much as a copy: a still street with noise, crossed by boxes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace qdmd::bench {

// Packed frames of 3 (RGB) or 4 (RGBA, opaque) bytes a pixel. No two of the first million frames
// are alike, so that windows have full rank, as those of real cameras have.
class Camera {
 public:
  Camera(int width, int height, int pixel_bytes)
      : width_(width), height_(height), pixel_bytes_(pixel_bytes) {
    std::mt19937 rng(5);
    std::normal_distribution<double> normal(0, 3);
    std::vector<uint8_t> levels(kNoiseLevels);
    for (auto& level : levels)
      level = static_cast<uint8_t>(
          static_cast<int8_t>(std::lround(std::clamp(normal(rng), -20.0, 20.0))));
    picture_.resize(frame_bytes());
    // More noise than a frame needs: each frame begins at a place of its own.
    noise_.resize(frame_bytes() + static_cast<size_t>(pixel_bytes) * kNoisePlaces);
    for (size_t i = 0; i < noise_.size(); ++i)
      noise_[i] = is_alpha(i) ? uint8_t{0} : levels[rng() % kNoiseLevels];
    for (size_t i = 0; i < picture_.size(); ++i) {
      const size_t pixel = i / bytes(), x = pixel % size_t(width), y = pixel / size_t(width);
      const double shade =
          std::sin(0.021 * double(x) + double(i % bytes())) + std::cos(0.034 * double(y));
      picture_[i] = is_alpha(i) ? uint8_t{255} : static_cast<uint8_t>(128 + 40 * shade);
    }
  }

  size_t frame_bytes() const { return size_t(width_) * size_t(height_) * bytes(); }

  void render(int64_t index, uint8_t* out) const {
    // Fibonacci hashing: places that follow each other are far apart.
    const uint64_t place =
        (static_cast<uint64_t>(index) * 0x9E3779B97F4A7C15u) >> (64 - kNoiseBits);
    const uint8_t* noise = noise_.data() + place * bytes();
    const uint8_t* picture = picture_.data();
    const size_t size = frame_bytes();
    // The picture leaves room for the noise: sums need no clamp.
    for (size_t i = 0; i < size; ++i) out[i] = static_cast<uint8_t>(picture[i] + noise[i]);
    for (int box = 0; box < kBoxes; ++box) paint(index, box, out);
  }

 private:
  static constexpr int kBoxes = 3, kNoiseBits = 20, kNoisePlaces = 1 << kNoiseBits,
                       kNoiseLevels = 1 << 16;

  size_t bytes() const { return static_cast<size_t>(pixel_bytes_); }
  bool is_alpha(size_t i) const { return pixel_bytes_ == 4 && i % 4 == 3; }

  // A walker: a tenth of the width, a third of the height.
  void paint(int64_t index, int box, uint8_t* out) const {
    const int box_width = std::max(1, width_ / 10), box_height = std::max(1, height_ / 3);
    const int way = width_ + box_width;
    const int64_t walked = index * (box + 1) * std::max(1, width_ / 160) + box * way / kBoxes;
    const int left = static_cast<int>(walked % way) - box_width;
    const int top = (height_ - box_height) * box / kBoxes;
    for (int y = top; y < top + box_height; ++y)
      for (int x = std::max(0, left); x < std::min(width_, left + box_width); ++x) {
        uint8_t* pixel = out + (size_t(y) * size_t(width_) + size_t(x)) * bytes();
        for (int c = 0; c < 3; ++c) pixel[c] = static_cast<uint8_t>(40 + 70 * ((box + c) % 3));
      }
  }

  int width_, height_, pixel_bytes_;
  std::vector<uint8_t> picture_, noise_;
};

}  // namespace qdmd::bench
