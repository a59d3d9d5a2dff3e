#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs a benchmark program shortly: run_short.sh PROGRAM FILTER. Fails where a benchmark reports an
# error, which Google Benchmark itself does not.
set -euo pipefail
out=$("$1" --benchmark_filter="$2" --benchmark_min_time=0.001)
echo "$out"
[ -n "$out" ] && ! grep -q 'ERROR OCCURRED' <<<"$out"
