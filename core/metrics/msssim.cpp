// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/metrics/msssim.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace qdmd {

namespace {

constexpr double kWeights[] = {0.0448, 0.2856, 0.3001, 0.2363, 0.1333};
constexpr int kScales = 5;
constexpr double kSigma = 1.5;  // px
constexpr double kC1 = (0.01 * 255) * (0.01 * 255), kC2 = (0.03 * 255) * (0.03 * 255);

cv::Mat matrix_of(const Plane<uint8_t>& plane) {
  const cv::Mat bytes(plane.height, plane.width, CV_8UC1,
                      const_cast<uint8_t*>(plane.values.data()));
  cv::Mat real;
  bytes.convertTo(real, CV_64F);
  return real;
}

// Samples of the Gaussian around the middle of the window, which for an even side lies between two
// pixels; their sum is 1.
cv::Mat gaussian(int side) {
  cv::Mat kernel(side, 1, CV_64F);
  for (int i = 0; i < side; ++i) {
    const double distance = i - (side - 1) / 2.0;
    kernel.at<double>(i) = std::exp(-distance * distance / (2 * kSigma * kSigma));
  }
  return kernel / cv::sum(kernel)[0];
}

// Only where the window lies inside the picture.
cv::Mat local_mean(const cv::Mat& picture, const cv::Mat& kernel) {
  cv::Mat mean;
  cv::sepFilter2D(picture, mean, CV_64F, kernel, kernel, {0, 0});
  return mean(cv::Rect(0, 0, picture.cols - kernel.rows + 1, picture.rows - kernel.rows + 1));
}

struct Similarity {
  double ssim, contrast_structure;
};

Similarity similarity(const cv::Mat& a, const cv::Mat& b, const cv::Mat& kernel) {
  const cv::Mat mu_a = local_mean(a, kernel), mu_b = local_mean(b, kernel);
  const cv::Mat mu_aa = mu_a.mul(mu_a), mu_bb = mu_b.mul(mu_b), mu_ab = mu_a.mul(mu_b);
  const cv::Mat var_a = local_mean(a.mul(a), kernel) - mu_aa;
  const cv::Mat var_b = local_mean(b.mul(b), kernel) - mu_bb;
  const cv::Mat cov = local_mean(a.mul(b), kernel) - mu_ab;
  cv::Mat cs, brightness;
  cv::divide(2 * cov + kC2, var_a + var_b + kC2, cs);
  cv::divide(2 * mu_ab + kC1, mu_aa + mu_bb + kC1, brightness);
  return {cv::mean(cs.mul(brightness))[0], cv::mean(cs)[0]};
}

cv::Mat halved(const cv::Mat& picture) {
  cv::Mat even, half;
  cv::copyMakeBorder(picture, even, 0, picture.rows % 2, 0, picture.cols % 2, cv::BORDER_REPLICATE);
  cv::resize(even, half, {even.cols / 2, even.rows / 2}, 0, 0, cv::INTER_AREA);
  return half;
}

}  // namespace

int msssim_window(int width, int height) { return std::clamp(std::min(width, height) / 16, 1, 11); }

double msssim(const Plane<uint8_t>& a, const Plane<uint8_t>& b) {
  require_same_size(a, b);
  const cv::Mat kernel = gaussian(msssim_window(a.width, a.height));
  cv::Mat x = matrix_of(a), y = matrix_of(b);
  double product = 1;
  for (int scale = 0; scale < kScales; ++scale) {
    if (scale > 0) x = halved(x), y = halved(y);
    const Similarity s = similarity(x, y, kernel);
    const double term = scale + 1 < kScales ? s.contrast_structure : s.ssim;
    product *= std::pow(std::max(term, 0.0), kWeights[scale]);
  }
  return product;
}

}  // namespace qdmd
