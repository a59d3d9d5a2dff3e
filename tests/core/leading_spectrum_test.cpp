// SPDX-License-Identifier: LGPL-2.1-or-later
// The largest singular value by Lanczos steps, against the whole spectrum.
#include "core/dmd/reduced_qdmd.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// Both solve X X^H u = u sigma^2; rounding of a product of m columns is below m eps sigma^2, and
// the whole spectrum takes some such steps.
void expect_leading_pair(const Clip& clip, bool must_converge) {
  const auto factor = factorize_gram(quaternion_gram_of(clip));
  const Eigen::Index m = factor.r.cols();
  const auto past = factor.r.left_cols(m - 1);
  const auto product = past * past.conjugate_transpose();
  const double largest = hermitian_eigen(product).values(0);
  const auto leading = internal::leading_spectrum<double>(past);
  ASSERT_TRUE(leading || !must_converge);
  if (!leading) return;
  const double tolerance = 16 * static_cast<double>(m) * kEpsilon;
  ASSERT_EQ(leading->sigma.size(), 1);
  const double squared = leading->sigma(0) * leading->sigma(0);
  EXPECT_NEAR(squared, largest, tolerance * largest);
  EXPECT_NEAR(leading->u.norm(), 1, tolerance);
  EXPECT_LE(
      (product * leading->u - leading->u.scale_cols(Eigen::VectorXd::Constant(1, squared))).norm(),
      tolerance * largest);
}

TEST(LeadingSpectrum, OfFramesOfOneScene) {
  std::mt19937 rng(120);
  for (size_t frames : {2u, 3u, 8u, 40u, 120u}) {
    SCOPED_TRACE(frames);
    expect_leading_pair(noisy_clip(300, frames, 3, rng), true);
    expect_leading_pair(noisy_clip(300, frames, 40, rng), true);
    expect_leading_pair(moving_box_clip(300, frames, 20, rng), true);
    expect_leading_pair(drifting_clip(300, frames, 0.97, rng), true);
  }
}

TEST(LeadingSpectrum, OfStaticAndRandomFrames) {
  std::mt19937 rng(121);
  expect_leading_pair(static_clip(random_picture(50, rng), 12), true);
  for (size_t frames : {2u, 6u, 30u}) expect_leading_pair(random_clip(200, frames, rng), true);
}

// Orthogonal frames of one length: every direction is the leading one.
TEST(LeadingSpectrum, OfEqualSingularValues) {
  Clip clip(16, 8);
  for (size_t t = 0; t < 8; ++t) clip.frames[t][t] = 200;
  expect_leading_pair(clip, true);
}

// Two that are nearly equal take more steps than there are: the whole spectrum has to do it then.
TEST(LeadingSpectrum, OfNearlyEqualSingularValuesIsRightOrMissing) {
  Clip clip(128, 64);
  for (size_t t = 0; t < 64; ++t) clip.frames[t][t] = static_cast<uint8_t>(255 - t / 32);
  expect_leading_pair(clip, false);
}

TEST(LeadingSpectrum, OfBlackFramesIsMissing) {
  EXPECT_FALSE(internal::leading_spectrum<double>(QuaternionMatrixd(3, 3)));
}

}  // namespace
}  // namespace qdmd::test
