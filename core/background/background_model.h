// The pictures of a solved window: evaluates L(t) at pixels.
#pragma once

#include <vector>

#include "core/dmd/temporal_model.h"
#include "core/gram/window.h"

namespace qdmd {

// L(t) of one solved window. A few modes are kept as pictures, which makes a frame cost 3 K
// products per pixel; many modes, whose pictures would take more memory than the window itself,
// combine the window's frames directly at 9 m products per pixel.
class BackgroundModel {
 public:
  // `window` is read here and, while the combination is direct, until the next build.
  void build(const Window& window, const TemporalModel& model);

  // Sets the time of the following calls, in frames from the solved window's first snapshot.
  void set_time(double t);
  // L at pixels first .. first + count - 1, rounded to 8 bits and clamped to 0 .. 255, into one
  // array a channel. count <= kMaxRun.
  void evaluate(size_t first, size_t count, uint8_t* const out[3]) const;

  static constexpr size_t kMaxRun = 1024;

 private:
  const Window* window_ = nullptr;
  TemporalModel model_;
  Eigen::MatrixXd basis_;
  bool direct_ = false;
  size_t pixels_ = 0;
  std::vector<float> pictures_;  // picture k at k * pixels_
  // 3 x K over pictures, or 3 x 3m over the window's planes; row-major by channel.
  std::vector<float> weights_;
  Eigen::Index terms_ = 0;
};

}  // namespace qdmd
