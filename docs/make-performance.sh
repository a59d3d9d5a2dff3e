#!/usr/bin/env bash
# Puts the tables and plots of docs/performance.md anew, in less than ten minutes on an idle
# machine. What the programs print stays in build/performance.
#
#   docs/make-performance.sh [--short | --page]
#
# --short: two minutes, to try the script; its numbers say little. --page: from the results of last time.
set -euo pipefail
cd "$(dirname "$0")/.."

form=${1:-whole}
case "$form" in
  whole) turns=5 min_time=0.2 live=60 memory=600 adjoint=(--turns 1) cases=. ;;
  --short) turns=1 min_time=0.01 live=5 memory=20 adjoint=(--short)
    cases='(160x120|320x240)/.*' ;;
  --page) ;;
  *) echo "usage: docs/make-performance.sh [--short | --page]" >&2; exit 2 ;;
esac

tests/install-dependencies.sh build test docs
results=build/performance
mkdir -p "$results"

if [ "$form" != --page ]; then
  again=()
  [ ! -f build/build.ninja ] || again=(--reconfigure)
  meson setup "${again[@]}" build -Dtests=enabled >/dev/null
  bench=build/tests/bench
  ninja -C build gst/libgstqdmd.so "${bench#build/}"/{element,stages,passes,gram,adjoint,live}
  export GST_REGISTRY_1_0="$PWD/$results/registry.bin" QDMD_BENCH_TURNS=$turns

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
  google stages "stages/$cases"
  google passes '/(320x240|1920x1080)' --benchmark_min_time="$min_time"
  google gram '^peak|^[^rw].*/m:(60|100|200)/' --benchmark_min_time="$min_time"
  step adjoint.txt "$bench/adjoint" "${adjoint[@]}"
  step live-1080p.txt "$bench/live" --seconds "$live"
  step live-320x240.txt "$bench/live" --seconds "$memory" --width 320 --height 240 --unpaced
  step memory-live.txt "$bench/live" --seconds 10 --unpaced
  step memory-batch.txt "$bench/live" --seconds 8 --unpaced --mode batch
  uptime >"$results/load-after"
  echo "== done ($SECONDS s)" >&2
fi

mkdir -p docs/images/performance
/usr/bin/python3 docs/performance_page.py docs/performance.md docs/images/performance "$results"
