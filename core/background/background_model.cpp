#include "core/background/background_model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace qdmd {

void BackgroundModel::build(const Window& window, const TemporalModel& model) {
  window_ = &window;
  model_ = model;
  basis_ = model.basis();
  pixels_ = window.pixels();
  const auto pictures = static_cast<size_t>(basis_.rows());
  direct_ = pictures * sizeof(float) > static_cast<size_t>(kChannels * window.size());
  if (direct_) {
    pictures_.clear();
    return;
  }
  pictures_.resize(pictures * pixels_);
  // A matrix product over short runs of pixels, whose samples fit in the cache as doubles: at full
  // rank the coefficients of nearly parallel frames cancel, and single precision would show it.
  constexpr size_t kRun = 256;
  using RunMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RunMatrix samples = RunMatrix::Zero(basis_.cols(), kRun), levels(basis_.rows(), kRun);
  for (size_t first = 0; first < pixels_; first += kRun) {
    const size_t count = std::min(kRun, pixels_ - first);
    for (int t = 0; t < window.size(); ++t)
      for (int c = 0; c < kChannels; ++c)
        std::copy_n(window.plane(window.slot(t), c) + first, count,
                    samples.row(kChannels * t + c).data());
    levels.noalias() = basis_ * samples;
    for (size_t k = 0; k < pictures; ++k) {
      const double* level = levels.row(static_cast<Eigen::Index>(k)).data();
      std::transform(level, level + count, pictures_.data() + k * pixels_ + first,
                     [](double v) { return static_cast<float>(v); });
    }
  }
}

void BackgroundModel::set_time(double t) {
  const Eigen::MatrixXd weights =
      direct_ ? Eigen::MatrixXd(model_.weights(t) * basis_) : model_.weights(t);
  terms_ = weights.cols();
  weights_.resize(static_cast<size_t>(weights.size()));
  for (Eigen::Index c = 0; c < kChannels; ++c)
    for (Eigen::Index k = 0; k < terms_; ++k)
      weights_[static_cast<size_t>(c * terms_ + k)] = static_cast<float>(weights(c, k));
}

void BackgroundModel::evaluate(size_t first, size_t count, uint8_t* const out[3]) const {
  std::array<float, kMaxRun> sum;
  for (int c = 0; c < kChannels; ++c) {
    // Adding a half and truncating rounds to nearest in the range that survives the clamp.
    std::fill_n(sum.begin(), count, 0.5f);
    const float* weights = weights_.data() + c * terms_;
    for (Eigen::Index k = 0; k < terms_; ++k) {
      const float weight = weights[k];
      if (weight == 0) continue;
      if (direct_) {
        const int t = static_cast<int>(k) / kChannels;
        const uint8_t* plane =
            window_->plane(window_->slot(t), static_cast<int>(k) % kChannels) + first;
        for (size_t p = 0; p < count; ++p) sum[p] += weight * static_cast<float>(plane[p]);
      } else {
        const float* picture = pictures_.data() + static_cast<size_t>(k) * pixels_ + first;
        for (size_t p = 0; p < count; ++p) sum[p] += weight * picture[p];
      }
    }
    uint8_t* row = out[c];
    for (size_t p = 0; p < count; ++p)
      // The order of the comparisons sends a NaN (infinity less infinity) to zero.
      row[p] = static_cast<uint8_t>(sum[p] > 0.0f ? (sum[p] < 255.5f ? sum[p] : 255.0f) : 0.0f);
  }
}

}  // namespace qdmd
