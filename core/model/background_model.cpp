// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/model/background_model.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "core/passes/digits.h"

namespace qdmd {
namespace {

// rows x J to the order that combine_planes reads. low: the planes are twice as many, and the
// second half has digits of that unit.
template <typename Matrix>
void group_by_four(const Matrix& rows, bool low, double unit, std::vector<double>* out) {
  const Eigen::Index groups = (rows.rows() + 3) / 4, cols = (low ? 2 : 1) * rows.cols();
  out->assign(static_cast<size_t>(groups * 4 * cols), 0.0);
  const auto at = [&](Eigen::Index k, Eigen::Index j) -> double& {
    return (*out)[static_cast<size_t>(4 * ((k / 4) * cols + j) + k % 4)];
  };
  for (Eigen::Index k = 0; k < rows.rows(); ++k)
    for (Eigen::Index j = 0; j < rows.cols(); ++j) {
      at(k, j) = rows(k, j);
      if (low) at(k, rows.cols() + j) = unit * rows(k, j);
    }
}

constexpr std::array<float, 9> kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};

std::atomic<uint64_t> pictures_shown{0};  // by all models

}  // namespace

uint64_t BackgroundModel::bytes(size_t pixels, int snapshots, int pictures, bool keep_pictures,
                                int depth) {
  // More pictures than this are not made; what is frozen has three.
  const int direct_above = kChannels * snapshots / static_cast<int>(sizeof(float));
  const int made = keep_pictures || pictures <= direct_above ? std::max(pictures, kChannels)
                                                             : std::max(direct_above, kChannels);
  const auto planes = static_cast<uint64_t>(kChannels) * static_cast<uint64_t>(snapshots);
  // The pictures, their basis twice (as it is, and as combine_planes() reads it), and the planes.
  const uint64_t of_plane = 2 * sizeof(double) * static_cast<uint64_t>(made + 3) + sizeof(uint8_t*);
  return sizeof(float) * static_cast<uint64_t>(made) * pixels +
         static_cast<uint64_t>(sample_bytes(depth)) * planes * of_plane;
}

void BackgroundModel::make_pictures(size_t count) {
  samples_.resize(count * pixels_);
  pictures_.resize(count);
  for (size_t k = 0; k < count; ++k) pictures_[k] = samples_.data() + k * pixels_;
}

void BackgroundModel::begin(const SnapshotRange& snapshots, const TemporalModel& model,
                            bool keep_pictures) {
  pixels_ = snapshots.pixels();
  planes_.clear();
  for (int t = 0; t < snapshots.size(); ++t)
    for (int c = 0; c < kChannels; ++c) planes_.push_back(snapshots.plane(t, c));
  for (int t = 0; snapshots.depth() > 8 && t < snapshots.size(); ++t)
    for (int c = 0; c < kChannels; ++c) planes_.push_back(snapshots.samples(t, c).low);
  const auto pictures = static_cast<int>(model.basis().rows());
  begin_with(model, snapshots.size(),
             !keep_pictures && may_combine_directly(pictures, snapshots.size()));
}

void BackgroundModel::begin_from(int snapshots, size_t pixels, const TemporalModel& model) {
  pixels_ = pixels;
  planes_.clear();
  begin_with(model, snapshots, false);
}

void BackgroundModel::begin_with(const TemporalModel& model, int snapshots, bool direct) {
  // Moved, and not assigned: an Eigen matrix that finds no memory for another size is broken.
  model_ = TemporalModel(model);
  basis_ = model.basis();
  largest_ = Eigen::VectorXd(255 * basis_.cwiseAbs().rowwise().sum());
  frozen_ = steady_ = false;
  direct_ = direct;
  change();
  stride_ = 1;
  gains_.clear();
  limits_.clear();
  snapshot_planes_ = static_cast<size_t>(kChannels * snapshots);
  const auto pictures = static_cast<size_t>(basis_.rows());
  // Room for what freeze_at() makes of them, too. Room for more is made without the old ones beside
  // it.
  const size_t room = direct_ ? 0 : std::max<size_t>(pictures, kChannels) * pixels_;
  if (samples_.capacity() < room) {
    LargeVector<float>().swap(samples_);
    samples_.reserve(room);
  }
  make_pictures(direct_ ? 0 : pictures);
  if (!direct_) group(basis_);
}

void BackgroundModel::group(const Eigen::MatrixXd& rows) {
  group_by_four(rows, planes_.size() > snapshot_planes_, 1.0 / (1 << bits_below(depth_)),
                &coefficients_);
}

void BackgroundModel::build_slice(size_t first, size_t count) {
  if (!direct_) combine_runs(planes_.data(), planes_.size(), first, first, count);
}

void BackgroundModel::build_from(const uint8_t* const* planes, size_t first, size_t count) {
  combine_runs(planes, snapshot_planes_, 0, first, count);
}

void BackgroundModel::build_from(const uint16_t* const* planes, size_t first, size_t count) {
  combine_runs(planes, snapshot_planes_, 0, first, count);
  // In levels: a power of two, which rounds nothing.
  const float unit = 1.0f / static_cast<float>(1 << bits_below(depth_));
  for (float* picture : pictures_)
    for (size_t p = first; p < first + count; ++p) picture[p] *= unit;
}

// planes[j][from] is the first sample of pixel `first`.
template <typename T>
void BackgroundModel::combine_runs(const T* const* planes, size_t plane_count, size_t from,
                                   size_t first, size_t count) {
  // Short runs, whose samples of all planes stay in the second-level cache for every group of
  // pictures.
  constexpr size_t kRun = 256;
  std::array<float*, 4> sums;
  for (size_t done = 0; done < count; done += kRun)
    for (size_t k = 0; k < picture_count(); k += 4) {
      const size_t group = std::min<size_t>(4, picture_count() - k);
      for (size_t i = 0; i < group; ++i) sums[i] = pictures_[k + i] + first + done;
      combine_planes(coefficients_.data() + k * plane_count, group, planes, plane_count,
                     from + done, std::min(kRun, count - done), sums.data());
    }
}

bool BackgroundModel::is_finite() const {
  // Sums of so many planes are pictures in single precision.
  static constexpr double kLargest = 1e30;
  const bool gains = std::all_of(gains_.begin(), gains_.end(), [](const Gain& gain) {
    return std::all_of(gain.begin(), gain.end(), [](auto g) { return std::isfinite(g); });
  });
  return gains && model_.all_finite() && (basis_.array().abs() < kLargest).all();
}

void BackgroundModel::build(const SnapshotRange& snapshots, const TemporalModel& model) {
  begin(snapshots, model);
  build_slice(0, pixels_);
}

Gain BackgroundModel::light(double t) const {
  if (gains_.empty()) return kSameLight;
  const auto last = static_cast<double>(gains_.size() - 1);
  return gains_[static_cast<size_t>(std::clamp(std::round(t), 0.0, last))];
}

void BackgroundModel::change() { picture_ = ++pictures_shown; }

void BackgroundModel::take_weights(const float* weights, size_t count) {
  if (std::equal(weights_.begin(), weights_.end(), weights, weights + count)) return;
  weights_.assign(weights, weights + count);
  change();
}

void BackgroundModel::use_steady_weights(double t) {
  const double middle = (std::floor(t / kSteadyFrames) + 0.5) * kSteadyFrames;
  model_.weights(middle / stride_, &steady_weights_);
  // Lazy products take no memory.
  const Eigen::Vector3d moved = (steady_weights_ - time_weights_).cwiseAbs().lazyProduct(largest_);
  if (moved.maxCoeff() < kSteadyLevels / (1 << bits_below(depth_))) time_weights_ = steady_weights_;
}

// The light of that time.
void BackgroundModel::take_light(double t) {
  shown_light_ = light(t);
  const SampleLight light(shown_light_, range_);
  for (size_t c = 0; c < kChannels; ++c) offset_[c] = light.into(c).offset;
  ends_ = rgb_.converts() && *std::max_element(shown_light_.begin(), shown_light_.end()) > 1;
}

// evaluate() where R, G and B end: samples times `scale`, and `bias` more.
template <typename Sample>
void BackgroundModel::evaluate_ends(size_t first, size_t count, float scale, float bias,
                                    Sample* const out[3]) const {
  float levels[kChannels][kMaxRun];
  evaluate_with(
      first,
      [&](const float* weights, const float* const* pictures, size_t number, size_t at) {
        for (size_t c = 0; c < kChannels; ++c) {
          std::fill_n(levels[c], count, offset_[c]);
          for (size_t k = 0; k < number; ++k)
            for (size_t p = 0; p < count; ++p)
              levels[c][p] += weights[c * number + k] * pictures[k][at + p];
        }
      },
      count);
  float* const rows[kChannels] = {levels[0], levels[1], levels[2]};
  rgb_.clip(count, rows);
  const float most = 256 * scale - 1;
  for (size_t c = 0; c < kChannels; ++c)
    for (size_t p = 0; p < count; ++p)
      out[c][p] = static_cast<Sample>(std::clamp(scale * levels[c][p] + bias, 0.0f, most));
}

void BackgroundModel::set_time(double t) {
  take_light(t);
  if (frozen_) {
    std::array<float, 9> weights = kIdentity;
    if (!gains_.empty()) {
      const Gain gain = SampleLight(light(t), range_).gain;
      for (size_t c = 0; c < kChannels; ++c) weights[4 * c] = gain[c];
    }
    take_weights(weights.data(), weights.size());
    return;
  }
  model_.weights(t / stride_, &time_weights_);
  if (steady_) use_steady_weights(t);
  if (!gains_.empty()) {
    const Gain gain = SampleLight(light(t), range_).gain;
    for (size_t c = 0; c < gain.size(); ++c)
      time_weights_.row(static_cast<Eigen::Index>(c)) *= gain[c];
  }
  if (direct_) {
    if (direct_weights_.cols() != basis_.cols())
      direct_weights_ = Eigen::MatrixXd(kChannels, basis_.cols());
    direct_weights_.noalias() = time_weights_ * basis_;
    group(direct_weights_);
    change();
    return;
  }
  const auto pictures = static_cast<Eigen::Index>(picture_count());
  single_weights_.resize(kChannels * picture_count());
  Eigen::Map<Eigen::MatrixXf>(single_weights_.data(), pictures, kChannels) =
      time_weights_.transpose().cast<float>();
  take_weights(single_weights_.data(), single_weights_.size());
}

void BackgroundModel::combine_directly(size_t first, size_t count, float* const* out) const {
  combine_planes(coefficients_.data(), 3, planes_.data(), planes_.size(), first, count, out);
}

// evaluate(weights, pictures, how many there are, first): from the model's pictures, or from L(t)
// where the combination is direct.
template <typename Evaluate>
void BackgroundModel::evaluate_with(size_t first, const Evaluate& evaluate, size_t count) const {
  if (!direct_) {
    evaluate(weights_.data(), pictures_.data(), picture_count(), first);
    return;
  }
  std::array<std::array<float, kMaxRun + kSliceUnit>, 3> sums;
  float* const rows[3] = {sums[0].data(), sums[1].data(), sums[2].data()};
  const size_t offset = first % kSliceUnit;
  combine_directly(first - offset, count + offset, rows);
  evaluate(kIdentity.data(), rows, size_t{3}, offset);
}

void BackgroundModel::evaluate(size_t first, size_t count, uint8_t* const out[3]) const {
  if (ends_) return evaluate_ends(first, count, 1, depth_ > 8 ? 0 : 0.5f, out);
  const auto levels = depth_ > 8 ? high_digits_of : levels_of;
  evaluate_with(
      first,
      [&](const float* weights, const float* const* pictures, size_t number, size_t at) {
        levels(weights, pictures, number, at, count, out, offset_);
      },
      count);
}

void BackgroundModel::evaluate_deep(size_t first, size_t count, uint16_t* const out[3]) const {
  if (ends_)
    return evaluate_ends(first, count, static_cast<float>(1 << bits_below(depth_)), 0.5f, out);
  evaluate_with(
      first,
      [&](const float* weights, const float* const* pictures, size_t number, size_t at) {
        deep_levels_of(weights, pictures, number, depth_, at, count, out, offset_);
      },
      count);
}

void BackgroundModel::evaluate(size_t first, size_t count, const MutableSamples out[3]) const {
  if (depth_ == 8) {
    uint8_t* const levels[3] = {out[0].high, out[1].high, out[2].high};
    evaluate(first, count, levels);
    return;
  }
  uint16_t samples[kChannels][kMaxRun];
  uint16_t* const whole[3] = {samples[0], samples[1], samples[2]};
  evaluate_deep(first, count, whole);
  for (size_t c = 0; c < kChannels; ++c) split_digits(samples[c], depth_, count, out[c]);
}

void BackgroundModel::evaluate_all(size_t pixels, const MutableSamples out[3], Pool* pool) const {
  const auto make = [&](size_t run) {
    const size_t first = run * kMaxRun;
    const MutableSamples to[3] = {out[0] + first, out[1] + first, out[2] + first};
    evaluate(first, std::min(kMaxRun, pixels - first), to);
  };
  const size_t runs = (pixels + kMaxRun - 1) / kMaxRun;
  if (pool)
    pool->run(runs, make);
  else
    for (size_t run = 0; run < runs; ++run) make(run);
}

void BackgroundModel::freeze_at(double t) {
  if (frozen_) return;
  set_time(t);
  if (direct_) {
    make_pictures(3);
    combine_directly(0, pixels_, pictures_.data());
    for (size_t c = 0; c < kChannels; ++c)
      if (offset_[c] != 0)
        for (size_t p = 0; p < pixels_; ++p) pictures_[c][p] += offset_[c];
  } else {
    // The pictures make room for L(t), pixel by pixel.
    const size_t pictures = picture_count();
    samples_.resize(std::max<size_t>(pictures, 3) * pixels_);
    levels_in_place(weights_.data(), pictures, pixels_, samples_.data(), offset_);
    make_pictures(3);
  }
  direct_ = false;
  frozen_ = true;
  gains_.clear();
  offset_ = {};
  ends_ = false;
  weights_.assign(kIdentity.begin(), kIdentity.end());
  change();
}

void BackgroundModel::freeze_but_for_light(double t) {
  std::vector<Gain> gains;
  gains.swap(gains_);
  freeze_at(t);
  gains_.swap(gains);
}

void BackgroundModel::make_room(size_t pixels, bool limits) {
  weights_.reserve(kIdentity.size());
  pictures_.reserve(kChannels);
  if (limits) limits_.reserve(pixels);
  if (samples_.capacity() >= kChannels * pixels) return;
  // Without the old ones beside it, unless they are in use.
  if (picture_count() == 0) LargeVector<float>().swap(samples_);
  samples_.reserve(kChannels * pixels);
  make_pictures(picture_count());
}

void BackgroundModel::freeze_as(const OwnedPicture& picture, const std::vector<uint8_t>* limits,
                                size_t pixels) {
  pixels_ = pixels;
  make_pictures(kChannels);
  // Nobody knows bits that the picture does not have: the middle of what they can be. Video of 8
  // bits has the picture's highest ones, as its frames would; other video has it rounded.
  const int known = std::min(picture.depth, depth_);
  const auto unit = 1.0f / static_cast<float>(1 << bits_below(picture.depth));
  const float middle = depth_ == 8 ? 0 : known == 8 ? 0.5f : depth_ > known ? unit / 2 : 0;
  for (size_t c = 0; c < kChannels; ++c) {
    const Samples samples = picture.samples(c);
    for (size_t p = 0; p < pixels; ++p)
      pictures_[c][p] = static_cast<float>(samples.high[p]) + middle +
                        (known > 8 ? unit * static_cast<float>(samples.low[p]) : 0);
  }
  if (limits)
    limits_ = *limits;
  else
    limits_.clear();
  gains_.clear();
  offset_ = {};
  ends_ = false;
  weights_.assign(kIdentity.begin(), kIdentity.end());
  direct_ = false;
  frozen_ = true;
  change();
}

}  // namespace qdmd
