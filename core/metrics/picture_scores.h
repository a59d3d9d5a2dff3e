// SPDX-License-Identifier: LGPL-2.1-or-later
// The six measures by which the field compares background pictures.
//
// Definitions: L. Maddalena and A. Petrosino, "Towards benchmarking scene background
// initialization" (SBI data set, 2015), and P.-M. Jodoin et al., "Extensive benchmark and survey of
// modeling methods for scene background initialization" (SBMnet, 2017). All but CQM look at the
// rounded luma of plane.h.
#pragma once

#include "core/metrics/plane.h"

namespace qdmd {

// Levels of luma by which an error pixel differs, exclusive.
inline constexpr int kErrorLevels = 20;

// PSNR is infinite for identical pictures; tables need a number. It is also the most that a PSNR
// can be, so that no picture scores better than an identical one.
inline constexpr double kMaxPsnr = 100;  // dB

struct PictureScores {
  double age = 0;     // average grey-level error, in levels of luma: lower is better
  double peps = 0;    // share of error pixels, 0..1 (not per cent): lower is better
  double pceps = 0;   // share of clustered error pixels, 0..1 (not per cent): lower is better
  double msssim = 0;  // 0..1, higher is better
  double psnr = 0;    // dB, up to kMaxPsnr: higher is better
  double cqm = 0;     // dB, up to kMaxPsnr: higher is better
};

// Scores a background against the truth. Throws std::invalid_argument where sizes differ.
PictureScores score_picture(const ImageView& background, const ImageView& truth);

// Mean of |Y - Y_truth|.
double average_grey_error(const Plane<uint8_t>& a, const Plane<uint8_t>& b);

struct ErrorPixels {
  double all = 0;  // share of pixels with |Y - Y_truth| > kErrorLevels
  double clustered =
      0;  // share of pixels whose 4-neighbours are error pixels as they are themselves
};
// Clustered error pixels are the erosion of the error pixels by a diamond of radius 1. As in any
// erosion, neighbours outside the picture do not speak against a pixel.
ErrorPixels error_pixels(const Plane<uint8_t>& a, const Plane<uint8_t>& b);

// 10 log10(255^2 / mean squared difference), at most kMaxPsnr.
double psnr(const Plane<uint8_t>& a, const Plane<uint8_t>& b);
double psnr(const Plane<int>& a, const Plane<int>& b);

// Colour image quality measure: 0.9449 PSNR(Y') + 0.0551 (PSNR(U') + PSNR(V')) / 2. Source: Y.
// Yalman and I. Erturk, "A new color image quality measure based on YUV transformation and PSNR for
// human vision system", 2013; the weights are the shares of rods and cones in the eye.
double colour_quality(const ImageView& background, const ImageView& truth);

}  // namespace qdmd
