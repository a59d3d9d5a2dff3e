// SPDX-License-Identifier: LGPL-2.1-or-later
// L(t) as a real linear combination of the window's planes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/quaternion/matrix.h"

namespace qdmd {

// L(t) = sum_p phi_p exp(omega_p t) b_p (the paper's equation "sepmet", background part) in real
// arithmetic. A mode is a linear combination of snapshots, so with W the 3m x n matrix of the
// window's planes (row 3 t + c: channel c of snapshot t),
//     pictures = basis() W             (K x n, once per window)
//     L(t)     = weights(t) pictures   (3 x n, once per frame)
// t counts frames from the window's first snapshot and may lie outside the window.
// K = 0 is the zero background.
class TemporalModel {
 public:
  explicit TemporalModel(int snapshots = 0) : snapshots_(snapshots) {}

  // Adds the quaternion mode phi = sum_t x_t combination_t with its share of the background,
  // phi lambda^(t - reference_time) amplitude. combination: m x 1.
  void add_mode(const QuaternionMatrixd& combination, std::complex<double> lambda,
                double reference_time, const Quaterniond& amplitude);
  // Adds a complex mode of one channel; its share is the real part of the same expression.
  void add_channel_mode(int channel, const Eigen::VectorXcd& combination,
                        std::complex<double> lambda, double reference_time,
                        std::complex<double> amplitude);

  // No number in it is infinite or not one.
  bool all_finite() const;
  Eigen::Index picture_count() const { return static_cast<Eigen::Index>(rows_.size()); }
  // K x 3m.
  Eigen::MatrixXd basis() const;
  // 3 x K, finite for every t: growth saturates far above the range of a picture.
  Eigen::MatrixXd weights(double t) const;
  // Writes the weights into `weights`, which is resized where it has another size.
  void weights(double t, Eigen::MatrixXd* weights) const;

 private:
  struct Term {
    int channel;  // -1: a quaternion mode, rows for 1, i, j, k of phi b / |b|; else Re, Im of phi
    Eigen::Index first_row;
    int row_count;
    std::complex<double> lambda;
    double reference_time;
    Quaterniond amplitude;
  };
  int snapshots_;
  std::vector<Eigen::VectorXd> rows_;
  std::vector<Term> terms_;
};

// The mean of so many snapshots, at all times.
TemporalModel mean_of_frames(int snapshots);

// lambda^t, with 0^0 = 1, for any real t >= 0 where lambda is 0. Its size saturates at e^600.
template <typename Real>
std::complex<Real> power(const std::complex<Real>& lambda, double t) {
  using std::atan2, std::cos, std::exp, std::log, std::sin;
  const Real size = Quaternion<Real>(lambda).norm();
  if (t == 0) return Real(1);
  if (!(size > Real(0))) return Real(0);
  const Real exponent = std::min(Real(log(size) * Real(t)), Real(600));
  const Real angle = atan2(lambda.imag(), lambda.real()) * Real(t);
  const Real length = exp(exponent);
  return {Real(length * cos(angle)), Real(length * sin(angle))};
}

}  // namespace qdmd
