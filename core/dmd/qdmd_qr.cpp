// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/qdmd.h"
#include "core/dmd/reduced_qdmd.h"

namespace qdmd {
namespace {

using Index = Eigen::Index;

// Rows [first, first + count) of the n x m matrix of snapshots, below `above`.
QuaternionMatrixd stacked(const QuaternionMatrixd& above, const SnapshotRange& snapshots,
                          Index first, Index count) {
  const Index m = snapshots.size(), top = above.rows();
  QuaternionMatrixd stack(top + count, m);
  stack.a.topRows(top) = above.a;
  stack.b.topRows(top) = above.b;
  for (int t = 0; t < snapshots.size(); ++t)
    for (Index p = 0; p < count; ++p) {
      const auto pixel = static_cast<size_t>(first + p);
      stack.set(top + p, t,
                Quaterniond(0.0, snapshots.sample(t, 0, pixel), snapshots.sample(t, 1, pixel),
                            snapshots.sample(t, 2, pixel)));
    }
  return stack;
}

}  // namespace

BackgroundModes qdmd_from_qr(const SnapshotRange& snapshots, const DmdOptions& options) {
  const Index m = snapshots.size(), n = static_cast<Index>(snapshots.pixels());
  // The factor of the rows so far on top of the next block (sequential TSQR; Demmel, Grigori,
  // Hoemmen and Langou 2012): as stable as one factorization, in the memory of a block.
  const Index block = std::max<Index>(512, 2 * m);
  SnapshotFactor<double> factor;
  factor.r = QuaternionMatrixd(0, m);
  for (Index first = 0; first < n; first += block)
    factor.r = qr(stacked(factor.r, snapshots, first, std::min(block, n - first)), false).r;
  factor.tolerance = static_cast<double>(std::max(n, m)) * std::numeric_limits<double>::epsilon();
  // The pivots of frames that equal others shrink by epsilon each time, down to what underflows.
  const double least = factor.tolerance * factor.r.norm();
  factor.triangular = factor.r.rows() >= m - 1;
  for (Index k = 0; factor.triangular && k + 1 < m; ++k)
    factor.triangular = factor.r.a(k, k).real() > least;
  return reduced_qdmd(factor, options);
}

}  // namespace qdmd
