// SPDX-License-Identifier: LGPL-2.1-or-later
// Time against pixels and against the window, part by part: what exponents are fitted to.
#pragma once

#include "tests/bench/accuracy_table.h"

namespace qdmd::bench {

// After `seconds` of processor time, what is slow is not repeated.
void add_scaling(bool brief, int turns, double seconds, Table* table, Steps* steps);

}  // namespace qdmd::bench
