// SPDX-License-Identifier: LGPL-2.1-or-later
// Numbers that tests share, for those that need nothing else of test_util.h: it takes long to
// compile.
#pragma once

#include <limits>

namespace qdmd::test {

inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace qdmd::test
