// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <opencv2/imgproc.hpp>

#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

class FocusSearch : public Effect {
 public:
  FocusSearch(Values values, const StreamSource&) : deviation_(values[0]), times_(values.last(3)) {}

  void sensor(FrameState& state) override {
    if (deviation_ == 0 || !times_.on(state.time)) return;
    Picture& picture = state.picture;
    cv::Mat samples(picture.height, picture.width, CV_8UC3, picture.samples.data());
    cv::GaussianBlur(samples, samples, {}, deviation_, deviation_, cv::BORDER_REPLICATE);
  }

 private:
  double deviation_;
  Times times_;
};

constexpr Parameter kParameters[] = {
    {"deviation", "px", 3, 0, 30, "standard deviation of the blur"},
    Times::kFrom,
    Times::kSeconds,
    Times::kEvery,
};

}  // namespace

const EffectInfo kFocusSearch = {
    "focus-search",
    "disturbance: the camera looks for its focus, and frames are blurred; the truth stays sharp",
    kSensor,
    kBuffers,
    kParameters,
    make_effect<FocusSearch>};

}  // namespace qdmd::scene
