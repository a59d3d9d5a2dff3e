// SPDX-License-Identifier: LGPL-2.1-or-later
// The time budget in the element: what it makes of some milliseconds a frame, with and without
// others who want the processor.
#pragma once

#include "tests/bench/accuracy_table.h"

namespace qdmd::bench {

// On wall clocks, unlike the other parts: a budget is about them. Throws std::runtime_error where
// the plugin cannot be loaded.
void add_budgets(bool brief, Table* table, Steps* steps);

}  // namespace qdmd::bench
