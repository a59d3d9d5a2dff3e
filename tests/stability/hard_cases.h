// SPDX-License-Identifier: LGPL-2.1-or-later
// Named windows that are hard to decompose.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/planes/snapshot_range.h"

namespace qdmd::stability {

struct HardCase {
  std::string name;
  std::string hard;  // what is hard about it, one clause
  std::function<Window()> make;
  // Too many pixels for Solver::adjoint, whose memory is some hundred bytes a pixel and frame.
  bool large = false;
  // Singular values or eigenvalues repeat exactly: Solver::adjoint, which takes every other column
  // of the complex adjoint's vectors as the paper does, cannot be right.
  bool repeats = false;
};

// Always the same windows, bit for bit.
const std::vector<HardCase>& hard_cases();

}  // namespace qdmd::stability
