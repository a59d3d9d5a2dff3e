#!/usr/bin/env bash
# Runs the fuzz targets of tests/fuzz with clang's libFuzzer, and its address and undefined
# behaviour sanitizers, in a folder of their own. What it finds is left there as crash-*: mend it, and
# move the file to tests/fuzz/cases/TARGET, from where the normal suite runs it again.
#
#   tests/fuzz.sh                          the short form: 10,000 runs of the targets that compile in
#                                          seconds (scene, learnt)
#   tests/fuzz.sh --runs N [TARGET...]     so many of each target: 1000000 takes hours (default: all)
set -euo pipefail
cd "$(dirname "$0")/.."

runs=10000
targets=(scene learnt)
if [ "${1:-}" = --runs ] && [ "$#" -ge 2 ]; then
  runs=$2
  shift 2
  targets=(scene learnt dataset core element)
  [ "$#" -eq 0 ] || targets=("$@")
elif [ "$#" -gt 0 ]; then
  sed -n '2,/^set/s/^# \?//p' "$0" >&2
  exit 2
fi
tests/install-dependencies.sh build test fuzz

build=build-fuzz
again=()
[ ! -f "$build/build.ninja" ] || again=(--reconfigure)
# Of undefined behaviour what numbers do, and no optimization: with all kinds of it, and Eigen, the
# rest would take most of an hour to compile.
checks=signed-integer-overflow,shift,float-cast-overflow,integer-divide-by-zero
CXX=clang++ meson setup "${again[@]}" "$build" -Dfuzz=true -Dtests=enabled -Dscene=enabled \
  -Db_sanitize=address -Db_lundef=false -Doptimization=0 -Ddebug=false -Dwerror=false \
  -Dcpp_args="-fsanitize=fuzzer-no-link,$checks -fno-sanitize-recover=all" \
  -Dcpp_link_args="-fsanitize=$checks" >"$build.log" ||
  { tail -n 20 "$build.log" >&2; exit 1; }
wanted=()
for target in "${targets[@]}"; do wanted+=("tests/fuzz/fuzz-$target"); done
ninja -C "$build" "${wanted[@]}" gst/libgstqdmd.so

# A size that is refused is asked for all the same; the threads of GLib's own types stay.
export ASAN_OPTIONS="allocator_may_return_null=1:detect_leaks=${DETECT_LEAKS:-1} ${ASAN_OPTIONS:-}"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1 ${UBSAN_OPTIONS:-}"
export LSAN_OPTIONS="suppressions=$PWD/tests/fuzz/lsan.supp:print_suppressions=0 ${LSAN_OPTIONS:-}"
for target in "${targets[@]}"; do
  echo "== $target: $runs runs"
  mkdir -p "$build/corpus/$target" "tests/fuzz/cases/$target"
  (cd "$build" && "tests/fuzz/fuzz-$target" -runs="$runs" -max_len=512 -timeout=30 -rss_limit_mb=4096 \
    -print_final_stats=1 -verbosity=1 -close_fd_mask=1 \
    "corpus/$target" "../tests/fuzz/cases/$target" 2>"$target.log") || {
    tail -n 40 "$build/$target.log" >&2
    exit 1
  }
  tail -n 7 "$build/$target.log"
done
