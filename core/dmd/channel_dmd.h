// SPDX-License-Identifier: LGPL-2.1-or-later
// Exact DMD of one colour channel (the paper's Algorithm 1), from its Gram matrix.
#pragma once

#include "core/dmd/options.h"

#include <Eigen/Core>

namespace qdmd {

// The background part of a real decomposition of m snapshots, P complex modes. Non-real modes come
// with their conjugates, so that the sum below is real:
// L(t) = Re sum_p X combination_p lambda_p^(t - reference_time_p) amplitude_p.
struct ChannelModes {
  Eigen::VectorXcd eigenvalues;     // P
  Eigen::MatrixXcd combination;     // m x P
  Eigen::VectorXcd amplitudes;      // P
  Eigen::VectorXd reference_times;  // P, frames
  DmdSummary summary;
};

// g = [x_1 .. x_m]^T [x_1 .. x_m], m x m. Rank, tolerance and degenerate windows as in
// qdmd_from_gram; `solver` is not looked at. The mode nearest the origin stands for its conjugate
// too: half of a pair would be half a background.
ChannelModes channel_dmd(const Eigen::MatrixXd& g, const DmdOptions& options);

}  // namespace qdmd
