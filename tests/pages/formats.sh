#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the tables and the plot of the formats into docs/formats.md anew. Takes about three minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"

tests/install-dependencies.sh build test docs
build gst/libgstqdmd.so gst/libgstqdmdscene.so tests/bench/formats

build/tests/bench/formats --benchmark_filter=768x576 --benchmark_min_time=0.05 \
  --benchmark_format=json --benchmark_repetitions=5 \
  --benchmark_report_aggregates_only=true >"$results/cost.json" 2>/dev/null
mkdir -p docs/images/formats
/usr/bin/python3 tests/pages/formats_page.py docs/formats.md "$results" docs/images/formats
