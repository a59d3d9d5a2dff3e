// SPDX-License-Identifier: LGPL-2.1-or-later
// Random windows that hardly have a decomposition, and what each solver makes of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/dmd/options.h"
#include "tests/core/clips.h"

namespace qdmd::stability {

// Window `seed`: 1 to 20 pixels a side, 2 to `most_frames` frames, of one of many kinds: few
// distinct frames, frames twice, black parts, one channel, one level that blinks, cycles, fades,
// ramps, and mixtures. The same for ever.
struct RandomWindow {
  test::Clip clip;
  std::string kind;
};
RandomWindow random_window(uint64_t seed, int most_frames, size_t most_side = 20);

// Options that go with it: rank 0 to 4, either amplitude, often a threshold.
DmdOptions random_options(uint64_t seed);

// What went wrong, one line each; empty: nothing.
struct Verdict {
  std::vector<std::string> faults;
  double worst = 0;            // the largest true error over its bound
  std::vector<double> errors;  // the true errors over their bounds, by solver; -1: no finite bound
  int finite_bounds = 0, solves = 0;
  bool without_reference = false;  // 50 digits have no answer
};
// By all solvers. Finite always; `digits`: and no farther from 50 digits than the bound.
Verdict judge(const test::Clip& clip, const DmdOptions& options, bool digits);

}  // namespace qdmd::stability
