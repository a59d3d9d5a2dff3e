// SPDX-License-Identifier: LGPL-2.1-or-later
// Every hard case, solver, method and amplitude; errors against a reference in 50 digits.
#include <gtest/gtest.h>

#include <cmath>

#include "core/dmd/decompose.h"
#include "tests/core/solver_names.h"
#include "tests/stability/assessment.h"

namespace qdmd::stability {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// Above this the bound says nothing: any answer in range will do.
constexpr double kUndecided = 1e-2;

class HardCases : public testing::TestWithParam<size_t> {
 protected:
  const HardCase& hard_case() const { return hard_cases()[GetParam()]; }
};

// A condition number of the problem up to which the exact solvers owe 1e-12.
constexpr double kWellConditioned = 1e3;

void expect_as_good_as_possible(const HardCase& hard_case, Amplitude amplitude) {
  const Assessment assessment = assess(hard_case, amplitude);
  for (const auto& result : assessment.solvers) {
    SCOPED_TRACE(test::name_of(result.solver));
    ASSERT_TRUE(result.finite);
    ASSERT_LE(result.rank, assessment.rank);
    // Only what the documented tolerance covers may be counted as zero; factor 2 for the rounding
    // of the singular value itself.
    if (result.dropped) {
      EXPECT_LE(result.dropped_value, 2 * result.tolerance);
    }
    // Backward stable: 50 m epsilon.
    EXPECT_LE(result.residual, 50 * assessment.frames * kEpsilon);
    // The zero background is one of those that a fit to all frames may choose.
    if (amplitude == Amplitude::window) {
      EXPECT_LE(result.fit, 1 + 1e-7);
    }
    // The paper's own procedure: its columns fail where values repeat, and its Phi^+ loses digits
    // where other modes than the background's nearly coincide.
    if (result.solver == Solver::adjoint &&
        (hard_case.repeats || amplitude == Amplitude::first_frame))
      continue;
    if (result.bound > kUndecided) continue;
    EXPECT_LE(result.lambda_error, result.bound);
    EXPECT_LE(result.background_error, result.bound);
    if (assessment.sensitivity <= kWellConditioned &&
        (result.solver == Solver::gram_extended || result.solver == Solver::qr)) {
      EXPECT_FALSE(result.dropped);
      // The first frame alone says how strong the mode is: the end of a long window has the
      // rounding of lambda^m in it.
      const double limit = amplitude == Amplitude::window
                               ? 1e-12
                               : std::max(1e-12, 16 * assessment.frames * kEpsilon);
      EXPECT_LE(result.lambda_error, limit);
      EXPECT_LE(result.background_error, limit);
    }
  }
}

TEST_P(HardCases, WindowAmplitude) { expect_as_good_as_possible(hard_case(), Amplitude::window); }

TEST_P(HardCases, FirstFrameAmplitude) {
  if (hard_case().large) GTEST_SKIP() << "the other amplitude covers what is large about it";
  expect_as_good_as_possible(hard_case(), Amplitude::first_frame);
}

// Every combination of options ends, and gives numbers.
TEST_P(HardCases, NothingIsNaN) {
  const Window window = hard_case().make();
  Pool pool(2);
  SlidingGram sliding(window.capacity(), &pool);
  sliding.add_newest(window, window.size());
  const IntegerMatrix gram = sliding.matrix(window);
  for (bool channels : {false, true})
    for (auto solver : {Solver::gram, Solver::gram_extended, Solver::qr, Solver::adjoint})
      for (auto amplitude : {Amplitude::window, Amplitude::first_frame})
        for (int rank : {0, 1, 3})
          for (double threshold : {0.0, 0.3, 1e9}) {
            if (hard_case().large && (solver == Solver::adjoint || solver == Solver::qr)) continue;
            // The channels look at no solver.
            if (channels && solver != Solver::gram) continue;
            // Seconds for each channel's dense eigenproblems.
            if (channels && window.size() > 100 && (rank > 0 || threshold > 0)) continue;
            SCOPED_TRACE(std::string(test::name_of(solver)) + ", rank " + std::to_string(rank) +
                         ", threshold " + std::to_string(threshold));
            DmdOptions options;
            options.solver = solver;
            options.amplitude = amplitude;
            options.rank = rank;
            options.omega_threshold = threshold;
            const Decomposition result =
                channels ? decompose_channels(gram, options) : decompose(window, gram, options);
            EXPECT_TRUE(result.summary.converged);
            EXPECT_TRUE(std::isfinite(std::abs(result.summary.lambda)));
            EXPECT_FALSE(std::isnan(result.summary.omega));
            EXPECT_TRUE(std::isfinite(result.summary.residual));
            EXPECT_TRUE(std::isfinite(result.summary.condition));
            EXPECT_TRUE(result.background.basis().allFinite());
            for (double t : {0.0, window.size() / 2.0, window.size() - 1.0, 4.0 * window.size()})
              EXPECT_TRUE(result.background.weights(t).allFinite());
          }
}

std::string test_name(const testing::TestParamInfo<size_t>& info) {
  std::string text;
  for (char c : hard_cases()[info.param].name)
    if (std::isalnum(static_cast<unsigned char>(c))) text += c;
  return text;
}

INSTANTIATE_TEST_SUITE_P(Stability, HardCases, testing::Range<size_t>(0, hard_cases().size()),
                         test_name);

}  // namespace
}  // namespace qdmd::stability
