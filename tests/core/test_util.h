// What the tests of core share: random quaternions, options, L(t) in double.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/dmd/modes.h"
#include "core/gram/gram.h"
#include "core/quaternion/factorize.h"
#include "tests/core/clips.h"
#include "tests/core/constants.h"

namespace qdmd::test {

// ---- Quaternions ----

inline double distance(const Quaterniond& p, const Quaterniond& q) { return (p - q).norm(); }
inline double distance(const QuaternionMatrixd& p, const QuaternionMatrixd& q) {
  return (p - q).norm();
}

inline Quaterniond random_quaternion(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  const double w = normal(rng), x = normal(rng), y = normal(rng), z = normal(rng);
  return {w, x, y, z};
}

inline QuaternionMatrixd random_matrix(Eigen::Index rows, Eigen::Index cols, std::mt19937& rng) {
  QuaternionMatrixd m(rows, cols);
  for (Eigen::Index c = 0; c < cols; ++c)
    for (Eigen::Index r = 0; r < rows; ++r) m.set(r, c, random_quaternion(rng));
  return m;
}

inline QuaternionMatrixd random_unitary(Eigen::Index size, std::mt19937& rng) {
  return qr(random_matrix(size, size, rng)).q;
}

inline QuaternionMatrixd diagonal(const Eigen::VectorXcd& values) {
  QuaternionMatrixd m(values.size(), values.size());
  m.a.diagonal() = values;
  return m;
}

// |Q^H Q - I|
inline double orthonormality_error(const QuaternionMatrixd& q) {
  return distance(q.conjugate_transpose() * q, QuaternionMatrixd::identity(q.cols()));
}

// ---- Decompositions ----

inline DmdOptions options_of(Amplitude amplitude, int rank, double threshold) {
  DmdOptions options;
  options.amplitude = amplitude;
  options.rank = rank;
  options.omega_threshold = threshold;
  return options;
}

inline std::string describe(const DmdOptions& options) {
  return (options.amplitude == Amplitude::window ? "window" : "first-frame") +
         std::string(", rank ") + std::to_string(options.rank) + ", threshold " +
         std::to_string(options.omega_threshold);
}

inline std::vector<DmdOptions> every_option() {
  std::vector<DmdOptions> all;
  for (auto amplitude : {Amplitude::window, Amplitude::first_frame})
    for (int rank : {0, 1, 2, 3})
      for (double threshold : {0.0, 0.35, 1.0})
        all.push_back(options_of(amplitude, rank, threshold));
  return all;
}

// Repeated multiplication: nothing of core's own power() in it.
inline std::complex<double> integer_power(std::complex<double> base, int exponent) {
  std::complex<double> product = 1;
  for (int i = 0; i < std::abs(exponent); ++i) product *= base;
  return exponent < 0 ? 1.0 / product : product;
}

// Rounding of pixels of size 255 that a window with this condition number amplifies. 400 leaves
// room for m = 15 snapshots and the eigenvalues' own conditioning; at the worst condition here
// (9000) it is 1e-9 of the picture's scale.
inline double picture_tolerance(double condition) { return 400 * condition * kEpsilon * 255; }

// L(t) = sum_p X combination_p lambda_p^(t - reference_p) amplitude_p, not rounded.
inline QuaternionMatrixd background_at(const QuaternionMatrixd& x, const BackgroundModes& modes,
                                       int t) {
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

// The largest part of any pixel of L(t) - expected.
inline double largest_part(const QuaternionMatrixd& m) {
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
