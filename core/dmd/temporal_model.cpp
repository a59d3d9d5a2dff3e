// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/temporal_model.h"

#include <algorithm>
#include <cmath>

namespace qdmd {

void TemporalModel::add_mode(const QuaternionMatrixd& combination, std::complex<double> lambda,
                             double reference_time, const Quaterniond& amplitude) {
  // phi lambda^t b = (phi q) (q^-1 lambda^t b) for every q. A mode comes with any complex q, and
  // where its eigenvalue is nearly real, with nearly any: the least rounding decides. q = b / |b|
  // gives pictures the same bytes on all machines.
  const Quaterniond phase = amplitude.unit();
  terms_.push_back({-1, picture_count(), 4, lambda, reference_time, amplitude});
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3 * snapshots_, 4);
  for (int t = 0; t < snapshots_; ++t) {
    const Quaterniond c = combination.get(t, 0) * phase;
    // (R i + G j + B k) c, one column for each of the parts 1, i, j, k.
    rows.block<3, 4>(3 * t, 0) << -c.x, c.w, -c.z, c.y,  //
        -c.y, c.z, c.w, -c.x,                            //
        -c.z, -c.y, c.x, c.w;
  }
  for (int i = 0; i < 4; ++i) rows_.push_back(rows.col(i));
}

void TemporalModel::add_channel_mode(int channel, const Eigen::VectorXcd& combination,
                                     std::complex<double> lambda, double reference_time,
                                     std::complex<double> amplitude) {
  const int row_count = combination.imag().isZero(0) ? 1 : 2;
  terms_.push_back(
      {channel, picture_count(), row_count, lambda, reference_time, Quaterniond(amplitude)});
  const auto add_row = [&](const Eigen::VectorXd& part) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(3 * snapshots_);
    for (int t = 0; t < snapshots_; ++t) row(3 * t + channel) = part(t);
    rows_.push_back(row);
  };
  add_row(combination.real());
  // A real mode needs one picture.
  if (row_count == 2) add_row(combination.imag());
}

bool TemporalModel::all_finite() const {
  const auto finite = [](const Quaterniond& q) { return std::isfinite(q.squared_norm()); };
  return std::all_of(terms_.begin(), terms_.end(),
                     [&](const Term& term) {
                       return finite(Quaterniond(term.lambda)) && finite(term.amplitude) &&
                              std::isfinite(term.reference_time);
                     }) &&
         std::all_of(rows_.begin(), rows_.end(), [](const auto& row) { return row.allFinite(); });
}

Eigen::MatrixXd TemporalModel::basis() const {
  Eigen::MatrixXd basis(picture_count(), 3 * snapshots_);
  for (size_t k = 0; k < rows_.size(); ++k)
    basis.row(static_cast<Eigen::Index>(k)) = rows_[k].transpose();
  return basis;
}

Eigen::MatrixXd TemporalModel::weights(double t) const {
  Eigen::MatrixXd result;
  weights(t, &result);
  return result;
}

void TemporalModel::weights(double t, Eigen::MatrixXd* out) const {
  Eigen::MatrixXd& weights = *out;
  // Moved, and not resized: a matrix that finds no memory for another size is broken.
  if (weights.cols() != picture_count() || weights.rows() != 3)
    weights = Eigen::MatrixXd(3, picture_count());
  weights.setZero();
  for (const Term& term : terms_) {
    Quaterniond u = Quaterniond(power(term.lambda, t - term.reference_time)) * term.amplitude;
    if (term.channel < 0) {
      u = term.amplitude.unit().conj() * u;
      // The i, j and k parts of phi u, phi's parts along the columns.
      weights.block<3, 4>(0, term.first_row) << u.x, u.w, u.z, -u.y,  //
          u.y, -u.z, u.w, u.x,                                        //
          u.z, u.y, -u.x, u.w;
    } else {
      weights(term.channel, term.first_row) = u.w;
      if (term.row_count == 2) weights(term.channel, term.first_row + 1) = -u.x;
    }
  }
  static constexpr double kLargest = 1e30;
  weights = weights.unaryExpr([](double v) { return std::clamp(v, -kLargest, kLargest); });
}

TemporalModel mean_of_frames(int snapshots) {
  QuaternionMatrixd shares(snapshots, 1);
  shares.a.setConstant(1.0 / snapshots);
  TemporalModel model(snapshots);
  model.add_mode(shares, 1.0, 0, Quaterniond(1.0));
  return model;
}

}  // namespace qdmd
