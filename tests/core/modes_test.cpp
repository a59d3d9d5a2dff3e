// SPDX-License-Identifier: LGPL-2.1-or-later
// The rules by which all decompositions choose and scale modes.
#include "core/dmd/modes.h"

#include "core/dmd/temporal_model.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

TEST(OmegaMagnitude, IsTheSizeOfTheLogarithm) {
  EXPECT_EQ(omega_magnitude<double>(0.0), kInfinity);
  EXPECT_EQ(omega_magnitude<double>(1.0), 0);
  EXPECT_NEAR(omega_magnitude<double>(-1.0), M_PI, 4 * kEpsilon);
  EXPECT_NEAR(omega_magnitude<double>({0, 1}), M_PI / 2, 4 * kEpsilon);
  EXPECT_NEAR(omega_magnitude<double>({0.3, 0.4}), std::abs(std::log(std::complex(0.3, 0.4))),
              4 * kEpsilon);
}

using Indices = std::vector<Eigen::Index>;

TEST(SelectBackground, NearestFirst) {
  const std::complex<double> i(0, 1);
  const Eigen::VectorXcd values{{0.0, i, 0.9, 1.01, 0.9, -1.0}};
  EXPECT_EQ(select_background<double>(values, 0), (Indices{3}));
  EXPECT_EQ(select_background<double>(values, 0.005), (Indices{3})) << "none is that near";
  EXPECT_EQ(select_background<double>(values, 0.2), (Indices{3, 2, 4})) << "ties keep their order";
  EXPECT_EQ(select_background<double>(values, 2), (Indices{3, 2, 4, 1}));
  EXPECT_EQ(select_background<double>(values, kInfinity), (Indices{3, 2, 4, 1, 5, 0}));
  EXPECT_EQ(select_background<double>(Eigen::VectorXcd(), 1), Indices());
  EXPECT_EQ(select_background<double>(Eigen::VectorXcd{{0.0}}, 0), (Indices{0}))
      << "infinitely far";
}

TEST(SelectBackground, OneModeForThresholdZeroEvenAtATie) {
  EXPECT_EQ(select_background<double>(Eigen::VectorXcd{{1.0, 1.0}}, 0), (Indices{0}))
      << "a threshold of 0 asks for the one nearest the origin";
}

TEST(Power, OfComplexNumbers) {
  std::mt19937 rng(90);
  std::normal_distribution<double> normal;
  for (int n = -6; n <= 6; ++n) {
    const std::complex<double> lambda(normal(rng), normal(rng));
    const auto expected = integer_power(lambda, n);
    // An angle of up to 6 pi and an exponent of a few, rounded.
    EXPECT_LE(std::abs(power<double>(lambda, n) - expected), 64 * kEpsilon * std::abs(expected))
        << n;
  }
  EXPECT_LE(std::abs(power<double>({0, 1}, 0.5) - std::polar(1.0, M_PI / 4)), 4 * kEpsilon);
  EXPECT_EQ(power<double>(0.0, 0), 1.0);
  EXPECT_EQ(power<double>(0.0, 3), 0.0);
  EXPECT_EQ(power<double>(2.0, 0), 1.0);
}

TEST(Power, SaturatesInsteadOfOverflowing) {
  for (const std::complex<double> lambda : {std::complex<double>(1e3), {-1e3, 5e2}, {1e-3, 0}}) {
    const double t = std::abs(lambda) > 1 ? 1e6 : -1e6;
    const auto value = power<double>(lambda, t);
    EXPECT_TRUE(std::isfinite(std::abs(value)));
    EXPECT_NEAR(std::abs(value), std::exp(600.0), 1e3 * kEpsilon * std::exp(600.0));
  }
  EXPECT_EQ(power<double>(0.5, 1e6), 0.0);
}

TEST(FitReferenceTime, IsTheLastSnapshotForGrowingModes) {
  EXPECT_EQ(fit_reference_time<double>(0.9, 10), 0);
  EXPECT_EQ(fit_reference_time<double>(1.0, 10), 0);
  EXPECT_EQ(fit_reference_time<double>({0.8, 0.7}, 10), 9);
}

}  // namespace
}  // namespace qdmd::test
