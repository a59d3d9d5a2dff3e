// SPDX-License-Identifier: LGPL-2.1-or-later
// Random degenerate windows: a thousand, or with QDMD_LONG=1 twenty thousand.
#include "tests/stability/random_windows.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace qdmd::stability {
namespace {

// All solvers: finite always, and in every tenth window no farther from 50 digits than their bound.
TEST(RandomWindows, AreFiniteAndWithinTheirBounds) {
  const bool all = std::getenv("QDMD_LONG") != nullptr;
  const uint64_t count = all ? 20000 : 1000;
  int bounds = 0;
  for (uint64_t seed = 1; seed <= count; ++seed) {
    const auto window = random_window(seed, 12);
    const auto verdict = judge(window.clip, random_options(seed), all || seed % 10 == 0);
    bounds += verdict.finite_bounds;
    for (const auto& fault : verdict.faults)
      ADD_FAILURE() << "window " << seed << " (" << window.kind << "): " << fault;
  }
  // Bounds that know nothing would pass, too.
  EXPECT_GT(bounds, static_cast<int>(count) / 10 * 3);
}

}  // namespace
}  // namespace qdmd::stability
