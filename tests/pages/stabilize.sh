#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the tables, the plot and the picture of docs/stabilize.md anew. Takes about five minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"

tests/install-dependencies.sh build test docs
build gst/libgstqdmd.so gst/libgstqdmdscene.so tests/bench/align

build/tests/bench/align --benchmark_min_time=0.1 --benchmark_format=json \
  --benchmark_repetitions=3 --benchmark_report_aggregates_only=true >"$results/cost.json" 2>/dev/null
mkdir -p docs/images/stabilize
/usr/bin/python3 tests/pages/stabilize_page.py docs/stabilize.md "$results" docs/images/stabilize
shrink "$results/shaken.png" 1280 docs/images/stabilize/shaken.jpg
