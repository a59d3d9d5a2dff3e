// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/core/test_util.h"

namespace qdmd::test {

// ---- Quaternions ----

double distance(const QuaternionMatrixd& p, const QuaternionMatrixd& q) { return (p - q).norm(); }

Quaterniond random_quaternion(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  const double w = normal(rng), x = normal(rng), y = normal(rng), z = normal(rng);
  return {w, x, y, z};
}

QuaternionMatrixd random_matrix(Eigen::Index rows, Eigen::Index cols, std::mt19937& rng) {
  QuaternionMatrixd m(rows, cols);
  for (Eigen::Index c = 0; c < cols; ++c)
    for (Eigen::Index r = 0; r < rows; ++r) m.set(r, c, random_quaternion(rng));
  return m;
}

QuaternionMatrixd random_unitary(Eigen::Index size, std::mt19937& rng) {
  return qr(random_matrix(size, size, rng)).q;
}

QuaternionMatrixd diagonal(const Eigen::VectorXcd& values) {
  QuaternionMatrixd m(values.size(), values.size());
  m.a.diagonal() = values;
  return m;
}

double orthonormality_error(const QuaternionMatrixd& q) {
  return distance(q.conjugate_transpose() * q, QuaternionMatrixd::identity(q.cols()));
}

// ---- Decompositions ----

DmdOptions options_of(Amplitude amplitude, int rank, double threshold) {
  DmdOptions options;
  options.amplitude = amplitude;
  options.rank = rank;
  options.omega_threshold = threshold;
  return options;
}

std::string describe(const DmdOptions& options) {
  return (options.amplitude == Amplitude::window ? "window" : "first-frame") +
         std::string(", rank ") + std::to_string(options.rank) + ", threshold " +
         std::to_string(options.omega_threshold);
}

std::vector<DmdOptions> every_option() {
  std::vector<DmdOptions> all;
  for (auto amplitude : {Amplitude::window, Amplitude::first_frame})
    for (int rank : {0, 1, 2, 3})
      for (double threshold : {0.0, 0.35, 1.0})
        all.push_back(options_of(amplitude, rank, threshold));
  return all;
}

std::complex<double> integer_power(std::complex<double> base, int exponent) {
  std::complex<double> product = 1;
  for (int i = 0; i < std::abs(exponent); ++i) product *= base;
  return exponent < 0 ? 1.0 / product : product;
}

QuaternionMatrixd background_at(const QuaternionMatrixd& x, const BackgroundModes& modes, int t) {
  QuaternionMatrixd l(x.rows(), 1);
  for (Eigen::Index p = 0; p < modes.eigenvalues.size(); ++p) {
    QuaternionMatrixd mode = x * modes.combination.col(p);
    const int exponent = t - static_cast<int>(modes.reference_times(p));
    mode.scale_col(
        0, Quaterniond(integer_power(modes.eigenvalues(p), exponent)) * modes.amplitudes.get(p, 0));
    l += mode;
  }
  return l;
}

double largest_part(const QuaternionMatrixd& m) {
  double largest = 0;
  for (Eigen::Index r = 0; r < m.rows(); ++r)
    for (Eigen::Index c = 0; c < m.cols(); ++c) {
      const Quaterniond q = m.get(r, c);
      // Not std::max: a NaN has to win.
      for (double part : {q.w, q.x, q.y, q.z})
        if (!(std::abs(part) <= largest)) largest = std::abs(part);
    }
  return largest;
}

}  // namespace qdmd::test
