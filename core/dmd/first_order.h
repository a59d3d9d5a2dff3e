// SPDX-License-Identifier: LGPL-2.1-or-later
// How the one background mode of a solve moves when what it was made of moves, to first order.
#pragma once

#include <cstdint>
#include <optional>

#include "core/dmd/reduced_qdmd.h"

namespace qdmd {

// Numbers between -1 and 1 that repeat from run to run, of mean square 1/3.
class RepeatedRandom {
 public:
  explicit RepeatedRandom(uint64_t seed) : state_(2 * seed + 1) {}
  // A number of mean square size^2.
  Quaterniond operator()(double size) {
    const double w = next(), x = next(), y = next(), z = next();
    return Quaterniond(w, x, y, z) * (size * 0.8660254037844386);
  }

 private:
  double next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(static_cast<int64_t>(state_) >> 11) * 0x1p-52;
  }
  uint64_t state_;
};

// A random move of the snapshots or of their inner products.
struct Push {
  double frames = 0;    // root of the mean square of the elements of dR, R the snapshot factor
  double products = 0;  // the same of dG, beside what `frames` does
  double common = 0;    // what is added to the diagonal of G: |x|^2 of noise that is like no frame
  double residual = 0;  // what the eigenpair leaves, over the size of its two sides
};

// Where the modes are after `times` the push; `times` makes the movement small, but not so small
// that rounding drowns it.
struct FirstOrderMove {
  BackgroundModes modes;
  double times = 1;
  double relative = 0;  // how far the mode and its powers in the window moved, over their size
  // Full rank, each from one random vector: |(Q~ - 1)^-1| beside the mode, and |Q~|.
  double reach = 0, operator_size = 1;
};

// Where there is such a formula: one mode whose amplitude was fitted to the window, at full rank
// with Estimator::exact, or at rank one with any but Estimator::optimized. Empty elsewhere, and
// where other modes (or singular values) are too near for a few steps to tell.
//
// Full rank, H v = R11 v lambda: (H - R11) dv = R11 dv (lambda - 1) + R11 v dlambda - f with
// f = (dH - dR11 lambda) v, dv upright on v, by fixed-point steps that each solve with H - R11.
// Rank one, K w = w s^2 with K = X^H X (Estimator::total: X^H X + Y^H Y): (s^2 - K) dw = dK w less
// its part along w. Random matrices dH, dK are never made: only their product with one vector is.
std::optional<FirstOrderMove> first_order_move(const SnapshotFactor<double>& factor,
                                               const DmdOptions& options,
                                               const BackgroundModes& modes, const Push& push,
                                               uint64_t seed);

}  // namespace qdmd
