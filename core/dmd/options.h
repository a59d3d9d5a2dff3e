// SPDX-License-Identifier: LGPL-2.1-or-later
// What a decomposition is asked for, and what it reports.
#pragma once

#include <complex>
#include <limits>
#include <memory>
#include <vector>

namespace qdmd {

enum class Solver {
  gram,           // from the exact Gram matrix alone
  gram_extended,  // from the Gram matrix, factorized in double-double
  qr,             // from a Householder QR factorization of the pixel columns
  adjoint,        // the paper's procedure, literally, on the complex adjoint of the pixels
  automatic       // gram, and gram_extended where the bound of gram is not below kSureBound
};

// Levels: below a quarter, the background's own rounding to whole levels costs more.
inline constexpr double kSureBound = 0.25;

enum class Amplitude {
  window,      // least squares of the background modes over all snapshots
  first_frame  // b = Phi^+ x_1, the paper's
};

// How the operator is estimated from frames that have noise.
enum class Estimator {
  exact,             // Q~ = U^H Y V S^-1, the paper's: noise in X shrinks |lambda|
  forward_backward,  // the geometric mean of it and of that of time turned back
  total,             // on the frames' part that X and Y have in common (total least squares)
  optimized          // the modes' exponentials, fitted to all frames at once
};

struct DmdOptions {
  Solver solver = Solver::automatic;
  Amplitude amplitude = Amplitude::window;
  // Rank of the truncated decomposition; 0, or more than the numerical rank: full.
  int rank = 0;
  // Background: all modes with |omega| <= this, in rad/frame. 0, or no mode that near: the one
  // nearest the origin.
  double omega_threshold = 0;
  // The most modes that count as background (of exact DMD: in each channel), the nearest to the
  // origin first; 0: no limit.
  int max_modes = 0;
  Estimator estimator = Estimator::exact;
  // DmdSummary::spectrum is wanted; costs a solve for all modes. Not of exact DMD.
  bool spectrum = false;
};

// One mode of a decomposition.
struct SpectrumMode {
  std::complex<double> lambda;  // imaginary part >= 0
  double amplitude = 0;  // levels: root of the mean square, over pixels and channels, of its share
                         // of L where it is largest in the window
  bool background = false;
};

// Facts about one solve, of the mode nearest the origin (for exact DMD: of the channel whose
// mode is farthest from it).
struct DmdSummary {
  int rank = 0;                     // of X, after truncation
  int background_modes = 0;         // 0 where X is zero
  std::complex<double> lambda = 0;  // eigenvalue, imaginary part >= 0
  double omega = 0;                 // |ln lambda|, rad/frame; infinity where lambda = 0
  // The eigenpair's residual, relative: |Q~ w - w lambda| / (|Q~| |w|), or at full rank
  // |H v - R11 v lambda| / ((|H| + |lambda| |R11|) |v|). A few epsilon where all is well.
  double residual = 0;
  // Largest over smallest singular value that was kept; at full rank an estimate from below.
  double condition = 1;
  // False: the eigenvalue iteration did not end, and rank one was solved in its place.
  bool converged = true;
  // The solver that gave the result: another than was asked for where that one could not.
  Solver solver = Solver::gram;
  // The estimator that gave the result: exact where the one that was asked for found none.
  Estimator estimator = Estimator::exact;
  // No level of L(t) inside the window is farther from what exact arithmetic gives; infinite where
  // that cannot be told. Of exact DMD: not computed, infinite.
  double rounding_bound = std::numeric_limits<double>::infinity();
  // Root of the mean square of L(t)'s movement, in levels, when every level of the frames moves at
  // random by up to a half; infinite where another mode may become the nearest one.
  double sensitivity = std::numeric_limits<double>::infinity();
  // Where it was asked for: all modes, the nearest to the origin first. By the estimator that was
  // asked for; Estimator::optimized has no other modes than the background's: the exact ones.
  std::shared_ptr<const std::vector<SpectrumMode>> spectrum;
};

}  // namespace qdmd
