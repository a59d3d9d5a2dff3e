// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/align/landmarks.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace qdmd {
namespace {

// Levels a pixel: less is noise.
constexpr int kLeastSlope = 5;
// Tukey's constant, in standard deviations.
constexpr float kTukey = 4.685f;
// The noise of samples that are rounded, and interpolated between.
constexpr double kLeastNoise = 1.0;
// The share of the residuals, from the smallest on, that tells the noise; of a normal distribution
// it ends at 0.385 standard deviations.
constexpr double kLowerPart = 0.3, kLowerEnd = 0.385;
constexpr float kOutside = 1e6f;
// Unknown: gain, offset, the shift, and the turn and the growth of half a picture.
constexpr int kUnknown = 6;
// Pixels along the border where there is none.
constexpr int kBorder = 2;

// Means of 3 x 3 pixels, the nearer the more: the finest details of a picture do not move as the
// rest does where it was sampled beside.
float smoothed(const uint8_t* at, ptrdiff_t stride) {
  const uint8_t *a = at - stride, *b = at + stride;
  const int sum =
      (a[-1] + 2 * a[0] + a[1]) + 2 * (at[-1] + 2 * at[0] + at[1]) + (b[-1] + 2 * b[0] + b[1]);
  return static_cast<float>(sum) / 16;
}

// smoothed() between pixels, u to the right and v down from it, below 1.
float smoothed(const uint8_t* at, ptrdiff_t stride, float u, float v) {
  float sum = 0;
  const float down[4] = {1 - v, 2 - v, 1 + v, v};
  const uint8_t* row = at - stride;
  for (int i = 0; i < 4; ++i, row += stride)
    sum += down[i] * ((1 - u) * row[-1] + (2 - u) * row[0] + (1 + u) * row[1] + u * row[2]);
  return sum / 16;
}

// Samples from here on may be at the end of their range, in any format.
constexpr uint8_t kEnd = 235;

// True where one of `rows` x `rows` samples is at the end of their range; `at` is the second of the
// second row.
bool has_end(const uint8_t* at, ptrdiff_t stride, int rows) {
  const uint8_t* row = at - stride - 1;
  uint8_t most = 0;
  for (int y = 0; y < rows; ++y, row += stride)
    for (int x = 0; x < rows; ++x) most = std::max(most, row[x]);
  return most >= kEnd;
}

// Pixels of a row that are looked at together.
constexpr int kTogether = 64;

// The steepest pixel of a part of a picture.
struct Steepest {
  int slope = 0;  // of its eight neighbours, 8 times that of a pixel
  int x = 0, y = 0;

  // Looks at `count` pixels of a row from column `left` on; of equal ones the first counts.
  void look(const uint8_t* row, int left, int count, int at_y, ptrdiff_t along, ptrdiff_t across) {
    uint16_t slopes[kTogether];
    for (int first = left; first < left + count; first += kTogether) {
      const int size = std::min(kTogether, left + count - first);
      const uint8_t *a = row + first - along, *b = row + first + along;
      uint16_t most = 0;
      for (int i = 0; i < size; ++i) {
        const int difference =
            (b[i - across] + 2 * b[i] + b[i + across]) - (a[i - across] + 2 * a[i] + a[i + across]);
        slopes[i] = static_cast<uint16_t>(std::abs(difference));
        most = std::max(most, slopes[i]);
      }
      if (most <= slope) continue;
      slope = most;
      x = first + static_cast<int>(std::find(slopes, slopes + size, most) - slopes);
      y = at_y;
    }
  }
};

}  // namespace

Landmarks::Landmarks(int most)
    : most_(most),
      x_(static_cast<size_t>(most)),
      y_(x_.size()),
      level_(x_.size()),
      right_(x_.size()),
      down_(x_.size()),
      at_end_(x_.size()),
      residual_(x_.size()) {}

uint64_t Landmarks::bytes(int most) {
  return static_cast<uint64_t>(most) * (2 * sizeof(int32_t) + 4 * sizeof(float) + 1);
}

void Landmarks::choose(const GreyView& picture, const IgnoredAreas& ignored, int ignored_scale) {
  count_ = 0;
  width_ = picture.width, height_ = picture.height;
  if (most_ == 0 || std::min(picture.width, picture.height) < 2 * kBorder + 3) return;
  const double area = static_cast<double>(picture.width) * picture.height;
  const int side = std::max(3, static_cast<int>(std::ceil(std::sqrt(area / most_))));
  const ptrdiff_t stride = picture.width;
  const int cols = (picture.width - 2 * kBorder) / side,
            rows = (picture.height - 2 * kBorder) / side;
  for (int row = 0; row < rows; ++row)
    for (int col = 0; col < cols && count_ < most_; ++col) {
      // Half of them at edges of each direction.
      const bool upright = (row + col) % 2 == 0;
      const ptrdiff_t along = upright ? 1 : stride, across = upright ? stride : 1;
      Steepest best;
      for (int y = kBorder + row * side; y < kBorder + (row + 1) * side; ++y)
        best.look(picture.samples + y * stride, kBorder + col * side, side, y, along, across);
      if (best.slope < 8 * kLeastSlope) continue;
      if (ignored.has(best.x * ignored_scale, best.y * ignored_scale)) continue;
      const uint8_t* const at = picture.samples + best.y * stride + best.x;
      const auto i = static_cast<size_t>(count_++);
      x_[i] = static_cast<int32_t>(best.x);
      y_[i] = static_cast<int32_t>(best.y);
      level_[i] = smoothed(at, stride);
      at_end_[i] = has_end(at, stride, 3);
      right_[i] = (smoothed(at + 1, stride) - smoothed(at - 1, stride)) / 2;
      down_[i] = (smoothed(at + stride, stride) - smoothed(at - stride, stride)) / 2;
    }
}

int Landmarks::parts() const {
  constexpr int kAlong = 4, kSome = 2;
  std::array<int, kAlong * kAlong> found{};
  for (size_t i = 0; i < static_cast<size_t>(count_); ++i)
    ++found[static_cast<size_t>(kAlong * (kAlong * y_[i] / height_) + kAlong * x_[i] / width_)];
  return static_cast<int>(
      std::count_if(found.begin(), found.end(), [](int some) { return some >= kSome; }));
}

// Residuals of a frame at a pose.
void Landmarks::read(const GreyView& frame, const Pose& pose, const GreyLight& light) {
  const auto gain = static_cast<float>(1 + light.gain), offset = static_cast<float>(light.offset);
  const auto lit = [&](size_t i) { return gain * (level_[i] - 128) + 128 + offset; };
  const auto count = static_cast<size_t>(count_);
  const ptrdiff_t stride = frame.width;
  const bool other_light = light.is_other;
  if (pose.is_rest()) {
    for (size_t i = 0; i < count; ++i) {
      const uint8_t* const at = frame.samples + y_[i] * stride + x_[i];
      const bool unknown = other_light && (at_end_[i] != 0 || has_end(at, stride, 3));
      residual_[i] = unknown ? kOutside : smoothed(at, stride) - lit(i);
    }
    return;
  }
  const Affine to_frame = affine(inverse(pose), middle_of(width_, height_));
  const auto xx = static_cast<float>(to_frame.xx), xy = static_cast<float>(to_frame.xy),
             yx = static_cast<float>(to_frame.yx), yy = static_cast<float>(to_frame.yy),
             x0 = static_cast<float>(to_frame.offset.x), y0 = static_cast<float>(to_frame.offset.y);
  const auto right = static_cast<float>(frame.width - 2),
             end = static_cast<float>(frame.height - 2);
  for (size_t i = 0; i < count; ++i) {
    const auto px = static_cast<float>(x_[i]), py = static_cast<float>(y_[i]);
    const float x = x0 + xx * px + xy * py, y = y0 + yx * px + yy * py;
    if (!(x >= 1 && y >= 1 && x < right && y < end)) {
      residual_[i] = kOutside;
      continue;
    }
    const auto left = static_cast<int>(x), top = static_cast<int>(y);
    const float u = x - static_cast<float>(left), v = y - static_cast<float>(top);
    const uint8_t* const at = frame.samples + top * stride + left;
    const bool unknown = other_light && (at_end_[i] != 0 || has_end(at, stride, 4));
    residual_[i] = unknown ? kOutside : smoothed(at, stride, u, v) - lit(i);
  }
}

// The noise that the small ones of the residuals tell.
double Landmarks::noise_of_residuals() const {
  constexpr int kSteps = 4, kBins = 256;  // of 1/4 level
  std::array<int, kBins> bins{};
  int inside = 0;
  for (size_t i = 0; i < static_cast<size_t>(count_); ++i) {
    if (residual_[i] == kOutside) continue;
    ++inside;
    const float bin = kSteps * std::abs(residual_[i]);
    ++bins[static_cast<size_t>(std::min(bin, kBins - 1.0f))];
  }
  const double wanted = kLowerPart * inside;
  double sum = 0;
  for (size_t bin = 0; bin < kBins; ++bin) {
    const double here = bins[bin];
    if (sum + here >= wanted && here > 0)
      return std::max(kLeastNoise,
                      (static_cast<double>(bin) + (wanted - sum) / here) / kSteps / kLowerEnd);
    sum += here;
  }
  return kLeastNoise;
}

Fit Landmarks::step(const GreyView& frame, const Pose& pose, const GreyLight& light, bool turns,
                    double noise) {
  Fit fit;
  fit.pose = pose;
  fit.light = light;
  if (count_ < kFewest) return fit;
  read(frame, pose, light);
  fit.noise = noise > 0 ? noise : noise_of_residuals();
  return turns ? solved<kUnknown>(fit) : solved<kUnknown - 2>(fit);
}

// How many are free is known to the compiler, which keeps the sums of few in registers.
template <int kFree>
Fit Landmarks::solved(Fit fit) const {
  std::array<std::array<float, kFree + 1>, kFree> sums{};
  const Point middle = middle_of(width_, height_);
  const auto half = static_cast<float>(std::max(1.0, std::max(middle.x, middle.y)));
  const auto middle_x = static_cast<float>(middle.x), middle_y = static_cast<float>(middle.y);
  const float limit = kTukey * static_cast<float>(fit.noise), over = 1 / (limit * limit);
  double squares = 0, weights = 0, likeness = 0;
  int inside = 0, fitting = 0;
  for (size_t i = 0; i < static_cast<size_t>(count_); ++i) {
    const float e = residual_[i];
    inside += e != kOutside ? 1 : 0;
    const float far = 1 - e * e * over;
    if (far <= 0) continue;
    ++fitting;
    const float weight = far * far;
    weights += weight;
    likeness += weight * far;
    squares += weight * e * e;
    const float u = (static_cast<float>(x_[i]) - middle_x) / half,
                v = (static_cast<float>(y_[i]) - middle_y) / half;
    const float row[kUnknown] = {level_[i] - 128,
                                 1,
                                 right_[i],
                                 down_[i],
                                 right_[i] * u + down_[i] * v,
                                 down_[i] * u - right_[i] * v};
    for (size_t a = 0; a < kFree; ++a) {
      const float weighted = weight * row[a];
      for (size_t b = a; b < kFree; ++b) sums[a][b] += weighted * row[b];
      sums[a][kFree] += weighted * e;
    }
  }
  // For normal noise it is 0.87.
  fit.agree = inside > 0 ? std::min(1.0, likeness / 0.87 / inside) : 0;
  // Nothing fits.
  if (fitting < kFewest) return fit;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kUnknown, kUnknown>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kUnknown, 1>;
  Matrix normal(kFree, kFree);
  Vector right(kFree);
  for (int a = 0; a < kFree; ++a) {
    for (int b = a; b < kFree; ++b)
      normal(a, b) = normal(b, a) =
          static_cast<double>(sums[static_cast<size_t>(a)][static_cast<size_t>(b)]);
    right(a) = static_cast<double>(sums[static_cast<size_t>(a)][kFree]);
  }
  // What no landmark tells stays as it is.
  for (int a = 0; a < kFree; ++a) normal(a, a) += 1e-3 * weights * (a == 0 ? 1 : 0) + 1e-6;
  const Eigen::LDLT<Matrix> factors(normal);
  if (factors.info() != Eigen::Success || !(factors.vectorD().minCoeff() > 0)) return fit;
  const Vector solution = factors.solve(right);
  if (!solution.allFinite()) return fit;
  Vector unit = Vector::Zero(kFree);
  double variance = 0;
  for (int a : {2, 3}) {
    unit.setZero();
    unit(a) = 1;
    variance = std::max(variance, factors.solve(unit)(a));
  }
  fit.error = std::sqrt(variance * std::max(squares / weights, 1.0 / 12));
  fit.light.gain += solution(0);
  fit.light.offset += solution(1);
  fit.light_known = true;
  // Little of the canvas is in the frame, or too bright or too dark to say more.
  if (inside < count_ / 4) return fit;
  Pose step;
  step.x = solution(2), step.y = solution(3);
  if constexpr (kFree == kUnknown) {
    step.scale = std::hypot(1 + solution(4) / half, solution(5) / half);
    step.angle = std::atan2(solution(5) / half, 1 + solution(4) / half);
  }
  // The frame, at the pose, shows the landmarks' picture at step(p): frame(A p) = picture(step p).
  fit.pose = compose(step, fit.pose);
  fit.known = true;
  return fit;
}

double Landmarks::share_within(const GreyView& frame, int x, int y, const GreyLight& light,
                               double limit) const {
  const auto gain = static_cast<float>(1 + light.gain), offset = static_cast<float>(light.offset);
  const auto most = static_cast<float>(limit);
  const bool other_light = light.is_other;
  const ptrdiff_t stride = frame.width;
  int inside = 0, within = 0;
  for (size_t i = 0; i < static_cast<size_t>(count_); ++i) {
    const int at_x = x_[i] - x, at_y = y_[i] - y;
    if (at_x < 1 || at_y < 1 || at_x > frame.width - 2 || at_y > frame.height - 2) continue;
    const uint8_t* const at = frame.samples + at_y * stride + at_x;
    if (other_light && (at_end_[i] != 0 || has_end(at, stride, 3))) continue;
    ++inside;
    const float e = smoothed(at, stride) - (gain * (level_[i] - 128) + 128 + offset);
    within += std::abs(e) < most ? 1 : 0;
  }
  return inside >= std::max(kFewest, count_ / 4) ? static_cast<double>(within) / inside : 0;
}

}  // namespace qdmd
