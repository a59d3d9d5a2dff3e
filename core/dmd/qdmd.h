// Q-DMD (the paper's Algorithm 2) from the Gram matrix, and literally from the pixels.
#pragma once

#include "core/dmd/modes.h"

namespace qdmd {

// From the quaternion Gram matrix g = [x_1 .. x_m]^H [x_1 .. x_m] (m x m, Hermitian) alone.
// With X^H X = V S^2 V^H, Q~ = U^H Y V S^-1 equals S^-1 V^H (X^H Y) V S^-1. Singular values count
// as zero below sqrt(4 m epsilon) of the largest: the Gram matrix squares them. m = 0 or 1, and
// X = 0, have no mode (P = 0).
BackgroundModes qdmd_from_gram(const QuaternionMatrixd& g, const DmdOptions& options);

// The paper's procedure on the pixels themselves, x = [x_1 .. x_m] (n x m): the SVD of the complex
// adjoint of X and its odd columns, eigenvectors of the adjoint of Q~, Phi^+ x_1 on pixels. Time
// grows with n m^2, memory is several times adjoint_bytes(). Repeated singular values or
// eigenvalues, where odd columns fail, are this solver's documented limit.
BackgroundModes qdmd_from_adjoint(const QuaternionMatrixd& x, const DmdOptions& options);

// Estimate of the bytes that qdmd_from_adjoint needs for n pixels and m snapshots.
double adjoint_bytes(double pixels, double snapshots);

}  // namespace qdmd
