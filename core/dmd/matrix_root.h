// SPDX-License-Identifier: LGPL-2.1-or-later
// Inverses and square roots of small quaternion matrices.
#pragma once

#include <optional>

#include "core/quaternion/matrix.h"

namespace qdmd {

// A^-1 for square A; not finite where A is singular.
QuaternionMatrixd inverse(const QuaternionMatrixd& a);

// The root S of M = S^2 whose eigenvalues and vectors are nearest to those of `near`, by Newton's
// method: S E + E S = M - S^2, in the eigenvectors of S. Where two eigenvalues are nearly lambda
// and -lambda, M does not tell their vectors apart: what they share stays as it is in `near`. Empty
// where the method does not end.
std::optional<QuaternionMatrixd> root_near(const QuaternionMatrixd& square,
                                           const QuaternionMatrixd& near);

}  // namespace qdmd
