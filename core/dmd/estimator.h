// SPDX-License-Identifier: LGPL-2.1-or-later
// Decompositions that noise does not bend, from the same factor as the paper's.
#pragma once

#include "core/dmd/reduced_qdmd.h"

namespace qdmd {

// The background modes by options.estimator: reduced_qdmd() for Estimator::exact.
//
// forward_backward (Dawson et al. 2016): the square root of A_f A_b^-1 that is nearest to A_f = Q~;
// A_b is the same of time turned back. The eigenvalues of A_f say which modes are background. Where
// it finds no root, the result is that of exact, and DmdSummary::estimator says so.
// total (Hemati et al. 2017): X and Y times the projection on the leading right singular vectors
// of [X; Y], then as the paper.
// At full rank both are the paper's own: X and Y then span the same, time can be turned back
// without a rest, and no projection takes noise away. Rank 0 would make them idle, so it means 1
// for them.
//
// optimized (Askham and Kutz 2018): the background's modes, as many as Estimator::exact chooses
// with the same options, are fitted to all frames by variable projection: the eigenvalues minimize
// |[x_1 .. x_m] - Phi E|, E_pt = lambda_p^t, with the best Phi for each. The start is the exact
// one's; where the fit finds none that is better, it is the result.
BackgroundModes solve_factor(const SnapshotFactor<double>& factor, const DmdOptions& options);

}  // namespace qdmd
