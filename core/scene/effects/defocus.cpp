// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace qdmd::scene {
namespace {

class Defocus : public Effect {
 public:
  Defocus(Values values, const StreamSource&) : deviation_(values[0]) {}

  // Where the Gaussian is cut off.
  int margin(int, int) const override { return reach(); }

  void lens(FrameState& state) override {
    if (reach() == 0) return;
    if (state.wants(kFrame)) blur(&state.picture);
    if (state.wants(kTruth)) blur(&state.truth);
    if (!state.wants(kLabels)) return;
    blur_plane(&state.coverage);
    if (!state.shadow.samples.empty()) blur_plane(&state.shadow);
  }

 private:
  int reach() const { return static_cast<int>(std::ceil(3 * deviation_)); }

  template <int kSamples>
  static cv::Mat matrix(Raster<kSamples>* raster) {
    return cv::Mat(raster->height, raster->width, CV_8UC(kSamples), raster->samples.data());
  }

  template <int kSamples>
  void blur(Raster<kSamples>* raster) const {
    const int side = 2 * reach() + 1;
    cv::Mat samples = matrix(raster);
    cv::GaussianBlur(samples, samples, {side, side}, deviation_, deviation_, cv::BORDER_REPLICATE);
  }

  // A pixel to which an object gives any light is not background, however little it is.
  void blur_plane(Plane* plane) {
    const int side = 2 * reach() + 1;
    cv::dilate(matrix(plane), touched_, cv::Mat::ones(side, side, CV_8U));
    blur(plane);
    cv::Mat samples = matrix(plane);
    cv::max(samples, cv::min(touched_, 1), samples);
  }

  double deviation_;
  cv::Mat touched_;
};

constexpr Parameter kParameters[] = {
    {"deviation", "px", 1.5, 0, 30, "standard deviation of the blur"},
};

}  // namespace

const EffectInfo kDefocus = {
    "defocus",   "a lens out of focus: everything is blurred, the true background too",
    kLens,       kWarp | kBuffers,
    kParameters, make_effect<Defocus>};

}  // namespace qdmd::scene
