// SPDX-License-Identifier: LGPL-2.1-or-later
// What the tests of core share: random quaternions, options, L(t) in double.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
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

// Bodies with matrices are in test_util.cpp: Eigen's templates in them would take five seconds in
// each of the files that include this.
namespace qdmd::test {

// ---- Quaternions ----

inline double distance(const Quaterniond& p, const Quaterniond& q) { return (p - q).norm(); }
double distance(const QuaternionMatrixd& p, const QuaternionMatrixd& q);
Quaterniond random_quaternion(std::mt19937& rng);
QuaternionMatrixd random_matrix(Eigen::Index rows, Eigen::Index cols, std::mt19937& rng);
QuaternionMatrixd random_unitary(Eigen::Index size, std::mt19937& rng);
QuaternionMatrixd diagonal(const Eigen::VectorXcd& values);
// |Q^H Q - I|
double orthonormality_error(const QuaternionMatrixd& q);

// ---- Decompositions ----

DmdOptions options_of(Amplitude amplitude, int rank, double threshold);
std::string describe(const DmdOptions& options);
std::vector<DmdOptions> every_option();
// Repeated multiplication: nothing of core's own power() in it.
std::complex<double> integer_power(std::complex<double> base, int exponent);

// Rounding of pixels of size 255 that a window with this condition number amplifies. 400 leaves
// room for m = 15 snapshots and the eigenvalues' own conditioning; at the worst condition here
// (9000) it is 1e-9 of the picture's scale.
inline double picture_tolerance(double condition) { return 400 * condition * kEpsilon * 255; }

// L(t) = sum_p X combination_p lambda_p^(t - reference_p) amplitude_p, not rounded.
QuaternionMatrixd background_at(const QuaternionMatrixd& x, const BackgroundModes& modes, int t);
// The largest part of any element.
double largest_part(const QuaternionMatrixd& m);

}  // namespace qdmd::test
