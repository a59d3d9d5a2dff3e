// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace qdmd::scene {
namespace {

class Compression : public Effect {
 public:
  Compression(Values values, const StreamSource&) : quality_(static_cast<int>(values[0])) {}

  void sensor(FrameState& state) override {
    Picture& picture = state.picture;
    const cv::Mat frame(picture.height, picture.width, CV_8UC3, picture.samples.data());
    cv::cvtColor(frame, bgr_, cv::COLOR_RGB2BGR);
    cv::imencode(".jpg", bgr_, bytes_, {cv::IMWRITE_JPEG_QUALITY, quality_});
    cv::imdecode(bytes_, cv::IMREAD_COLOR, &bgr_);
    cv::Mat result = frame;
    cv::cvtColor(bgr_, result, cv::COLOR_BGR2RGB);
  }

 private:
  int quality_;
  cv::Mat bgr_;
  std::vector<uint8_t> bytes_;
};

constexpr Parameter kParameters[] = {
    {"quality", "percent", 30, 1, 100, "of JPEG, as libjpeg counts it", true},
};

}  // namespace

const EffectInfo kCompression = {"compression", "a codec's blocks: every frame goes through JPEG",
                                 kSensor,       kBuffers,
                                 kParameters,   make_effect<Compression>};

}  // namespace qdmd::scene
