#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs the fuzz targets of tests/fuzz with clang's libFuzzer, and its address and undefined
# behaviour sanitizers, in a folder of their own. What it finds is left there as crash-*: mend it, and
# move the file to tests/fuzz/cases/TARGET, from where the normal suite runs it again.
#
#   tests/fuzz.sh [--runs N] [TARGET...]     TARGET: scene, learnt, dataset, core, element (default:
#                                            all); N: 10000, minutes; 1000000 takes hours
#
# What continuous integration runs instead, in seconds and without clang: the tests fuzz-*, which
# give the same targets the inputs of tests/fuzz/cases and some of a generator.
set -euo pipefail
cd "$(dirname "$0")/.."

runs=10000
if [ "${1:-}" = --runs ] && [ "$#" -ge 2 ]; then
  runs=$2
  shift 2
fi
targets=("$@")
[ "$#" -gt 0 ] || targets=(scene learnt dataset core element)
for target in "${targets[@]}"; do
  if [ ! -f "tests/fuzz/${target}_fuzz.cpp" ]; then
    sed -n '3,/^set/s/^# \?//p' "$0" >&2
    exit 2
  fi
done
tests/install-dependencies.sh build test fuzz

build=build-fuzz
again=()
[ ! -f "$build/build.ninja" ] || again=(--reconfigure)
# Undefined behaviour of numbers only: with all kinds of it, and Eigen, compiling would take most of
# an hour.
checks=signed-integer-overflow,shift,float-cast-overflow,integer-divide-by-zero
CXX="${FUZZ_CXX:-clang++}" meson setup "${again[@]}" "$build" -Dfuzz=true -Dtests=enabled -Dscene=enabled \
  -Db_sanitize=address -Db_lundef=false -Doptimization=1 -Ddebug=false -Dwerror=false \
  -Dcpp_args="-fsanitize=fuzzer-no-link,$checks -fno-sanitize-recover=all" \
  -Dcpp_link_args="-fsanitize=$checks" >"$build.log" ||
  { tail -n 20 "$build.log" >&2; exit 1; }
wanted=()
for target in "${targets[@]}"; do
  wanted+=("tests/fuzz/fuzz-$target")
  [ "$target" != element ] || wanted+=(gst/libgstqdmd.so)
done
ninja -C "$build" "${wanted[@]}"

# A size that is refused is asked for all the same; the threads of GLib's own types stay.
# Deep stacks of each allocation took up to half of the time: give malloc_context_size=30 to see them.
export ASAN_OPTIONS="allocator_may_return_null=1:malloc_context_size=4:detect_leaks=${DETECT_LEAKS:-1}:${ASAN_OPTIONS:-}"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1 ${UBSAN_OPTIONS:-}"
export LSAN_OPTIONS="suppressions=$PWD/tests/fuzz/lsan.supp:print_suppressions=0 ${LSAN_OPTIONS:-}"
# Without entropic: its bookkeeping took two thirds of the time.
for target in "${targets[@]}"; do
  echo "== $target: $runs runs"
  mkdir -p "$build/corpus/$target" "tests/fuzz/cases/$target"
  (cd "$build" && "tests/fuzz/fuzz-$target" -runs="$runs" -max_len=512 -timeout=30 -rss_limit_mb=4096 \
    -print_final_stats=1 -entropic=0 -verbosity=1 -close_fd_mask=1 \
    "corpus/$target" "../tests/fuzz/cases/$target" 2>"$target.log") || {
    tail -n 40 "$build/$target.log" >&2
    exit 1
  }
  tail -n 7 "$build/$target.log"
done
