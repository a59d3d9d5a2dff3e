// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/metrics/picture_scores.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/metrics/msssim.h"

namespace qdmd {

namespace {

template <typename Value>
double psnr_of(const Plane<Value>& a, const Plane<Value>& b) {
  require_same_size(a, b);
  int64_t squares = 0;
  for (size_t i = 0; i < a.values.size(); ++i) {
    const int64_t difference = int64_t{a.values[i]} - int64_t{b.values[i]};
    squares += difference * difference;
  }
  if (squares == 0) return kMaxPsnr;
  const double mse = static_cast<double>(squares) / static_cast<double>(a.values.size());
  return std::min(kMaxPsnr, 10 * std::log10(255.0 * 255.0 / mse));
}

}  // namespace

double average_grey_error(const Plane<uint8_t>& a, const Plane<uint8_t>& b) {
  require_same_size(a, b);
  int64_t sum = 0;
  for (size_t i = 0; i < a.values.size(); ++i) sum += std::abs(int{a.values[i]} - int{b.values[i]});
  return static_cast<double>(sum) / static_cast<double>(a.values.size());
}

ErrorPixels error_pixels(const Plane<uint8_t>& a, const Plane<uint8_t>& b) {
  require_same_size(a, b);
  const auto wrong = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= a.width || y >= a.height) return true;
    return std::abs(int{a.at(x, y)} - int{b.at(x, y)}) > kErrorLevels;
  };
  int64_t all = 0, clustered = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      if (!wrong(x, y)) continue;
      ++all;
      if (wrong(x - 1, y) && wrong(x + 1, y) && wrong(x, y - 1) && wrong(x, y + 1)) ++clustered;
    }
  const auto pixels = static_cast<double>(a.values.size());
  return {static_cast<double>(all) / pixels, static_cast<double>(clustered) / pixels};
}

double psnr(const Plane<uint8_t>& a, const Plane<uint8_t>& b) { return psnr_of(a, b); }
double psnr(const Plane<int>& a, const Plane<int>& b) { return psnr_of(a, b); }

double colour_quality(const ImageView& background, const ImageView& truth) {
  const ReversibleYuv a = reversible_yuv(background), b = reversible_yuv(truth);
  return 0.9449 * psnr(a.y, b.y) + 0.0551 * (psnr(a.u, b.u) + psnr(a.v, b.v)) / 2;
}

PictureScores score_picture(const ImageView& background, const ImageView& truth) {
  require_same_size(background.width, background.height, truth.width, truth.height,
                    "the background", "the truth");
  const Plane<uint8_t> a = luma(background), b = luma(truth);
  const ErrorPixels errors = error_pixels(a, b);
  PictureScores scores;
  scores.age = average_grey_error(a, b);
  scores.peps = errors.all;
  scores.pceps = errors.clustered;
  scores.msssim = msssim(a, b);
  scores.psnr = psnr(a, b);
  scores.cqm = colour_quality(background, truth);
  return scores;
}

}  // namespace qdmd
