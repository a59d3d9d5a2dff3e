// SPDX-License-Identifier: LGPL-2.1-or-later
// How each solver does on a hard window, and what could be asked of it.
#pragma once

#include <string>
#include <vector>

#include "core/dmd/options.h"
#include "tests/stability/hard_cases.h"

namespace qdmd::stability {

struct SolverResult {
  Solver solver;
  bool finite = false;  // modes, amplitudes and summary
  int rank = 0;
  bool dropped = false;      // fewer singular values than the reference: see below
  double dropped_value = 0;  // the largest one dropped, over the largest
  double tolerance = 0;      // what the solver counts as zero, over the largest
  double lambda_error = 0;   // relative, to the reference of the same rank
  double background_error = 0;
  double bound = 0;  // what rounding may cost this solver here, for both errors
  double fit = 0;    // (sum |x_t - L(t)|^2 / sum |x_t|^2)^(1/2)
  double residual = 0;
};

struct Assessment {
  int frames = 0;
  int rank = 0;
  double condition = 1;  // of X, from the reference
  // Movement of the true answer when every snapshot is perturbed by 8 m epsilon of the longest,
  // times 10 for the directions that were not tried: no method in double can promise more.
  double movement = 0;
  // That movement over the perturbation, without the room: the condition number of the problem.
  double sensitivity = 0;
  std::vector<SolverResult> solvers;
};

// All solvers that can run on the case, at full rank, nearest mode.
Assessment assess(const HardCase& hard_case, Amplitude amplitude);

}  // namespace qdmd::stability
