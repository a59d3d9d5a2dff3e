// SPDX-License-Identifier: LGPL-2.1-or-later
// Q-DMD of a window in 50 decimal digits, and how far its answer moves when the window does.
#pragma once

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <vector>

#include "core/dmd/options.h"
#include "core/dmd/reduced_qdmd.h"
#include "core/gram/gram.h"

namespace qdmd::stability {

using Decimal = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>,
                                              boost::multiprecision::et_off>;

// What a solver is judged by: the eigenvalue, and L(t) at the first, middle and last snapshot.
struct Answer {
  int rank = 0;
  int modes = 0;
  std::complex<Decimal> lambda;
  std::vector<Decimal> background;  // three parts a probed pixel and time
  // The largest sum of the snapshots' shares, each in absolute value, over the largest |L|: what
  // one rounding of the shares costs.
  double cancellation = 1;
  // (sum_t |x_t - L(t)|^2 / sum_t |x_t|^2)^(1/2)
  double fit = 0;
  bool converged = true;  // as in DmdSummary
};

// Q-DMD of a window by the library's algorithm, in `Decimal`. The Gram matrix is exact and 50
// digits are more than it can square away, so the factor is too.
class DecimalSolver {
 public:
  // `probes`: the pixels at which L(t) is compared, three channels each in `pixels`
  // (3 probes x m).
  DecimalSolver(const IntegerMatrix& gram, Eigen::MatrixXd pixels);

  Answer solve(const DmdOptions& options) const;
  // Solves after a perturbation of every snapshot by `size` times the longest one, in a
  // direction that `seed` chooses within the span of the snapshots.
  Answer solve_perturbed(const DmdOptions& options, double size, unsigned seed) const;

  // Singular values of X = [x_1 .. x_{m-1}], largest first, exact zeros left out.
  std::vector<double> singular_values() const;

  // L(t) of modes that a solver found, in 50 digits.
  Answer answer(const QuaternionModes<double>& modes) const;

 private:
  Answer evaluate(const QuaternionModes<Decimal>& modes) const;

  SnapshotFactor<Decimal> factor_;
  Eigen::MatrixXd pixels_;
};

// |lambda - lambda'| / max(1, |lambda|) and max |L - L'| / max(1 level, max |L|); infinite where
// one has a mode and the other has none, or something is not a number.
struct Distance {
  double lambda = 0, background = 0;
};
Distance distance(const Answer& reference, const Answer& other);

}  // namespace qdmd::stability
