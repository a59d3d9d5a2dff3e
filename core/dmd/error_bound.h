// SPDX-License-Identifier: LGPL-2.1-or-later
// How far rounding, and data that move by half a level, can move a background.
#pragma once

#include "core/dmd/reduced_qdmd.h"

namespace qdmd {

// The coefficients of the snapshots in L(t), m x 1: L(t) = X shares.
QuaternionMatrixd shares_at(const BackgroundModes& modes, double t);

// How two backgrounds of the same snapshots differ at the window's first, middle and last frame,
// largest of the three, in levels; infinite where something is not a number. `r`: columns with the
// snapshots' inner products.
struct BackgroundDistance {
  double largest = 0;  // no channel of a pixel differs by more
  double mean = 0;     // root of the mean square over `pixels` and channels
};
BackgroundDistance background_distance(const QuaternionMatrixd& r, double pixels,
                                       const BackgroundModes& modes, const BackgroundModes& other);

// A solve that is asked how sure it is.
struct SolvedWindow {
  const QuaternionMatrixd& gram;  // exact, m x m
  double pixels;
  const DmdOptions& options;
  const SnapshotFactor<double>& factor;  // of `gram`, in double or in double-double
  const BackgroundModes& modes;          // reduced_qdmd(factor, options)
};

// A bound of what rounding in the decomposition costs L(t) inside the window, in levels of a
// channel of any pixel: the solve is repeated after random moves of what was factorized, larger
// than rounding's (docs/numerics.md derives sizes and room). Infinite where another mode may
// be the nearest one for all that is known. Singular values that `factor` took for zero count as
// zero here.
double rounding_bound(const SolvedWindow& solved);

// Root of the mean square, over pixels and channels, of how far L(t) moves when every level moves
// at random by up to one half, in levels. Infinite where another mode becomes the nearest one, or
// might.
double sensitivity(const SolvedWindow& solved);

}  // namespace qdmd
