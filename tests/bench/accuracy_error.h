// SPDX-License-Identifier: LGPL-2.1-or-later
// Numerical errors of the solvers against 50 digits: on windows whose condition number is a knob,
// on the hard cases of tests/stability, and beside their times on simulated scenes.
#pragma once

#include "tests/bench/accuracy_table.h"

namespace qdmd::bench {

// Windows whose condition number is a knob.
void add_conditions(bool brief, Table* table, Steps* steps);

// tests/stability's own.
void add_hard_cases(bool brief, Table* table, Steps* steps);

// Time beside error; after `seconds` of processor time, what is slow is not repeated.
void add_solvers(bool brief, int turns, double seconds, Table* table, Steps* steps);

}  // namespace qdmd::bench
