// SPDX-License-Identifier: LGPL-2.1-or-later
// Q-DMD (the paper's Algorithm 2), one function for each way to it.
#pragma once

#include "core/dmd/snapshot_factor.h"
#include "core/planes/snapshot_range.h"

namespace qdmd {

// R in double-double, rounded at the end: as good as a QR factorization of the pixels.
SnapshotFactor<double> factorize_gram_extended(const QuaternionMatrixd& g);

// From the quaternion Gram matrix g = [x_1 .. x_m]^H [x_1 .. x_m] (m x m, Hermitian) alone, for
// Solver::gram and Solver::gram_extended. The Gram matrix squares singular values: those below
// sqrt(4 m epsilon) of the largest count as zero. Factorized in double-double it does not matter,
// and the limit is 4 m epsilon. m = 0 or 1, and X = 0, have no mode (P = 0).
BackgroundModes qdmd_from_gram(QuaternionMatrixd g, const DmdOptions& options);

// From the triangular factor of a Householder QR factorization of the pixel columns, in double:
// the Gram matrix is not used. Time grows with n m^2, at many times the cost of the Gram matrix;
// memory is some hundred rows. Singular values below max(n, m) epsilon of the largest count as
// zero.
BackgroundModes qdmd_from_qr(const SnapshotRange& snapshots, const DmdOptions& options);

// The paper's procedure on the pixels themselves, x = [x_1 .. x_m] (n x m): the SVD of the complex
// adjoint of X and its odd columns, eigenvectors of the adjoint of Q~, Phi^+ x_1 on pixels. Time
// grows with n m^2, memory is several times adjoint_bytes(). Repeated singular values or
// eigenvalues, where odd columns fail, are this solver's documented limit.
BackgroundModes qdmd_from_adjoint(const QuaternionMatrixd& x, const DmdOptions& options);

// Estimate of the bytes that qdmd_from_adjoint needs for n pixels and m snapshots.
double adjoint_bytes(double pixels, double snapshots);

}  // namespace qdmd
