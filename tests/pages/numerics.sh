#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the tables of docs/notebook/numerics.md anew: the hard cases against 50 digits, what noise does to the
# estimators, and the times of the small problem. Takes some minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"

tests/install-dependencies.sh build test
build tests/stability/stability-table tests/stability/estimator-table tests/bench/solve
build/tests/stability/stability-table >"$results/cases.md"
build/tests/stability/estimator-table 8 >"$results/estimators.md"
build/tests/bench/solve --benchmark_repetitions=5 --benchmark_report_aggregates_only=true \
  --benchmark_format=json >"$results/times.json"

/usr/bin/python3 tests/pages/numerics_page.py docs/notebook/numerics.md "$results"
