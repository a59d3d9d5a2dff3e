#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the tables and plots of docs/performance.md and its notebook anew, in a quarter of an hour on an
# idle machine. What the programs print stays in build/performance.
#
#   tests/pages/performance.sh [--short | --page]
#
# --short: two minutes, to try the script; its numbers say little. --page: from the results of last time.
set -euo pipefail
source "$(dirname "$0")/common.sh"

form=${1:-whole}
case "$form" in
  whole) turns=5 min_time=0.2 live=60 memory=600 adjoint=(--turns 1) cases=. ;;
  --short) turns=1 min_time=0.01 live=5 memory=20 adjoint=(--short)
    cases='(160x120|320x240)/.*' ;;
  --page) ;;
  *) echo "usage: tests/pages/performance.sh [--short | --page]" >&2; exit 2 ;;
esac

tests/install-dependencies.sh build test docs

if [ "$form" != --page ]; then
  bench=build/tests/bench
  build gst/libgstqdmd.so "${bench#build/}"/{element,separate,stages,passes,gram,adjoint,live}
  export QDMD_BENCH_TURNS=$turns

  # step NAME COMMAND...: what a program prints, in $results/NAME; what it says meanwhile is shown.
  step() {
    local name=$1
    shift
    echo "== $name ($SECONDS s)" >&2
    "$@" >"$results/$name"
  }
  # google NAME FILTER OPTION...: the results in $results/NAME.json.
  google() {
    local name=$1 filter=$2
    shift 2
    echo "== $name ($SECONDS s)" >&2
    stdbuf -oL "$bench/$name" --benchmark_filter="$filter" --benchmark_out_format=json \
      --benchmark_out="$results/$name.json" "$@" 2>"$results/log" | stdbuf -oL cut -c1-90 >&2
    if grep error_message "$results/$name.json" >&2; then exit 1; fi
  }

  uptime >"$results/load-before"
  google element "frame/$cases"
  google separate "outputs/$cases"
  google stages "stages/$cases"
  google passes '/(320x240|1920x1080)' --benchmark_min_time="$min_time"
  google gram '^peak|^[^rw].*/m:(60|100|200)/' --benchmark_min_time="$min_time"
  step adjoint.txt "$bench/adjoint" "${adjoint[@]}"
  for method in robust qdmd; do
    of=("$bench/live" --method "$method")
    step "live-1080p-$method.txt" "${of[@]}" --seconds "$live"
    step "live-320x240-$method.txt" "${of[@]}" --seconds "$memory" --width 320 --height 240 --unpaced
    step "memory-live-$method.txt" "${of[@]}" --seconds 10 --unpaced
    step "memory-batch-$method.txt" "${of[@]}" --seconds 8 --unpaced --mode batch
  done
  uptime >"$results/load-after"
  echo "== done ($SECONDS s)" >&2
fi

mkdir -p docs/images/performance
/usr/bin/python3 tests/pages/performance_page.py docs/performance.md docs/notebook/performance.md \
  docs/images/performance "$results"
