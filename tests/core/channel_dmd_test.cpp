// SPDX-License-Identifier: LGPL-2.1-or-later
// Exact DMD of a channel against the paper's Algorithm 1, on pixels.
#include "core/dmd/channel_dmd.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "core/dmd/decompose.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

Eigen::MatrixXd channel_of(const Clip& clip, size_t channel) {
  Eigen::MatrixXd x(clip.pixels, clip.size());
  for (size_t t = 0; t < clip.size(); ++t)
    for (size_t p = 0; p < clip.pixels; ++p)
      x(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(t)) = clip.at(t, channel, p);
  return x;
}

// L, n x m. Whole pairs: a mode brings its conjugate.
Eigen::MatrixXd algorithm_1(const Eigen::MatrixXd& snapshots, const DmdOptions& options) {
  const Eigen::Index m = snapshots.cols();
  const Eigen::MatrixXd x = snapshots.leftCols(m - 1), y = snapshots.rightCols(m - 1);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(x, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::Index rank = options.rank > 0 ? options.rank : m - 1;
  const Eigen::MatrixXd v_over_s =
      svd.matrixV().leftCols(rank) * svd.singularValues().head(rank).cwiseInverse().asDiagonal();
  const Eigen::MatrixXd a_tilde = svd.matrixU().leftCols(rank).transpose() * y * v_over_s;
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(a_tilde);
  const Eigen::VectorXcd lambda = eigen.eigenvalues();
  const Eigen::MatrixXcd phi = (y * v_over_s).cast<std::complex<double>>() * eigen.eigenvectors();

  const auto omega = [&](Eigen::Index k) { return std::abs(std::log(lambda(k))); };
  double limit = kInfinity;
  for (Eigen::Index k = 0; k < rank; ++k) limit = std::min(limit, omega(k));
  limit = std::max(limit, options.omega_threshold) * (1 + 1e-9);  // conjugates differ in rounding
  std::vector<Eigen::Index> chosen;
  for (Eigen::Index k = 0; k < rank; ++k)
    if (omega(k) <= limit) chosen.push_back(k);
  const auto count = static_cast<Eigen::Index>(chosen.size());

  // The columns of the stacked problem x_t = sum_p phi_p lambda_p^t b_p.
  Eigen::MatrixXcd stack(x.rows() * m, count);
  for (Eigen::Index p = 0; p < count; ++p)
    for (int t = 0; t < m; ++t)
      stack.col(p).segment(t * x.rows(), x.rows()) =
          phi.col(chosen[static_cast<size_t>(p)]) *
          integer_power(lambda(chosen[static_cast<size_t>(p)]), t);
  Eigen::VectorXcd b(count);
  if (options.amplitude == Amplitude::first_frame) {
    const Eigen::VectorXcd all =
        phi.colPivHouseholderQr().solve(snapshots.col(0).cast<std::complex<double>>());
    for (Eigen::Index p = 0; p < count; ++p) b(p) = all(chosen[static_cast<size_t>(p)]);
  } else {
    const Eigen::VectorXcd all_frames =
        Eigen::Map<const Eigen::VectorXd>(snapshots.data(), snapshots.size())
            .cast<std::complex<double>>();
    b = stack.colPivHouseholderQr().solve(all_frames);
  }
  const Eigen::VectorXd l = (stack * b).real();
  return Eigen::Map<const Eigen::MatrixXd>(l.data(), x.rows(), m);
}

TEST(ChannelDmd, EqualsAlgorithm1OnPixels) {
  int several_modes = 0;
  for (const auto& [name, clip] : clips()) {
    const auto gram = gram_of(to_window(clip));
    for (size_t channel = 0; channel < 3; ++channel) {
      const Eigen::MatrixXd x = channel_of(clip, channel);
      for (const auto& options : every_option()) {
        SCOPED_TRACE(std::string(name) + ", " + describe(options));
        const auto modes = channel_dmd(channel_gram(gram, static_cast<int>(channel)), options);
        ASSERT_EQ(modes.summary.rank, options.rank > 0 ? options.rank : x.cols() - 1);
        if (modes.summary.background_modes > 2) ++several_modes;
        const Eigen::MatrixXd expected = algorithm_1(x, options);
        const Eigen::MatrixXcd phi = x.cast<std::complex<double>>() * modes.combination;
        Eigen::MatrixXd actual = Eigen::MatrixXd::Zero(x.rows(), x.cols());
        for (int t = 0; t < x.cols(); ++t)
          for (Eigen::Index p = 0; p < modes.eigenvalues.size(); ++p)
            actual.col(t) +=
                (phi.col(p) * (integer_power(modes.eigenvalues(p),
                                             t - static_cast<int>(modes.reference_times(p))) *
                               modes.amplitudes(p)))
                    .real();
        EXPECT_LE((actual - expected).cwiseAbs().maxCoeff(),
                  picture_tolerance(modes.summary.condition))
            << modes.eigenvalues.transpose();
      }
    }
  }
  EXPECT_GE(several_modes, 20);
}

// What is told of a window is told of the channel that changes most: one that stands still beside
// it must not hide that.
TEST(ChannelDmd, TheChannelThatChangesMostSpeaksForAll) {
  for (size_t changing = 0; changing < 3; ++changing) {
    SCOPED_TRACE("channel " + std::to_string(changing));
    Clip clip(64, 12);
    for (size_t t = 0; t < clip.size(); ++t)
      for (size_t c = 0; c < 3; ++c)
        for (size_t p = 0; p < clip.pixels; ++p)
          clip.set(t, c, p,
                   (50 + 3.0 * static_cast<double>(p)) * (c == changing ? std::pow(0.9, t) : 1));
    const auto gram = gram_of(to_window(clip));
    DmdOptions options;
    options.rank = 1;
    const double omega =
        channel_dmd(channel_gram(gram, static_cast<int>(changing)), options).summary.omega;
    ASSERT_NEAR(omega, -std::log(0.9), 0.01);  // whole levels are not quite 0.9 of each other
    EXPECT_EQ(decompose_channels(gram, options).summary.omega, omega);
  }
}

}  // namespace
}  // namespace qdmd::test
