// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/pixel_noise.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace qdmd {

PixelNoise::PixelNoise(int width, int height, const DecisionConstants& constants)
    : width_(static_cast<size_t>(width)),
      height_(height),
      most_samples_(constants.noise_samples),
      weight_of_moments_(constants.weight_of_moments),
      mean_(width_ * static_cast<size_t>(height), 0),
      before_((static_cast<size_t>(height) / kRows + 1) * width_) {
  rates_.factor = static_cast<int>(std::lround(256 * constants.mean_distances));
  rates_.most_of_moments = static_cast<int>(std::lround(256 * constants.most_of_moments));
}

uint64_t PixelNoise::bytes(int width, int height) {
  const auto rows = static_cast<uint64_t>(height);
  return static_cast<uint64_t>(width) * (sizeof(uint16_t) * rows + rows / kRows + 1);
}

void PixelNoise::forget() {
  std::fill(mean_.begin(), mean_.end(), uint16_t{0});
  frames_ = 0;
}

void PixelNoise::learn(int y, size_t left, size_t count, const uint16_t* squared,
                       const uint8_t* limit, const uint8_t* near, const uint8_t* now) {
  NoiseRates rates = rates_;
  rates.share =
      1 / static_cast<float>(std::min(static_cast<double>(frames_ / kRows + 1), most_samples_));
  // Nothing was remembered before the first frame.
  rates.share_of_moments =
      frames_ > 0 ? static_cast<float>(std::min(weight_of_moments_ / most_samples_, 1.0)) : 0;
  learn_noise(squared, limit, near, now,
              before_.data() + static_cast<size_t>(y / kRows) * width_ + left, rates, count,
              row(y) + left);
}

void PixelNoise::end_frame(const uint8_t* mask) {
  ++frames_;
  for (int y = 0; y < height_; ++y)
    if (learns_from(y))
      std::memcpy(before_.data() + static_cast<size_t>(y / kRows) * width_,
                  mask + static_cast<size_t>(y) * width_, width_);
}

}  // namespace qdmd
