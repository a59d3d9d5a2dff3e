// SPDX-License-Identifier: LGPL-2.1-or-later
// Multi-scale structural similarity.
#pragma once

#include "core/metrics/plane.h"

namespace qdmd {

// MS-SSIM of Z. Wang, E. P. Simoncelli and A. C. Bovik, "Multi-scale structural similarity for
// image quality assessment" (2003), computed as their code does: at each of five scales a Gaussian
// window (sigma 1.5 px) is moved over all places where it lies inside the picture; between scales 2
// x 2 pixels are averaged (the last row or column of an odd size counts twice). With
//   cs   = (2 cov + C2) / (var_a + var_b + C2)
//   ssim = cs (2 mu_a mu_b + C1) / (mu_a^2 + mu_b^2 + C1)
// and C = (K 255)^2, K = (0.01, 0.03), the result is the product of mean(cs)^w_1 .. mean(cs)^w_4
// and mean(ssim)^w_5, w = (0.0448, 0.2856, 0.3001, 0.2363, 0.1333).
//
// A mean below zero (pictures that are each other's negatives) has no real power of w: it counts as
// zero, and so does the whole measure.
//
// Throws std::invalid_argument where sizes differ.
double msssim(const Plane<uint8_t>& a, const Plane<uint8_t>& b);

// Side of the Gaussian window in px: 11, or below 176 px floor(shorter side / 16), which still fits
// at the fifth scale. Below 16 px that is none: there the window is one pixel, variances are zero,
// and only the brightness term of the fifth scale is left.
int msssim_window(int width, int height);

}  // namespace qdmd
