#!/usr/bin/env bash
# Which lines of core/ and gst/ the suite runs, in a folder of its own: hours, since nothing is
# optimized; name some tests for less. Prints a table, and the lines that are not run;
# build-coverage/coverage.txt keeps both. What runs the same lines for long is left out.
#
#   tests/coverage.sh [TEST...]      tests by their meson names (default: those of core and gst)
set -euo pipefail
cd "$(dirname "$0")/.."
tests/install-dependencies.sh build test coverage
build=build-coverage
again=()
[ ! -f "$build/build.ninja" ] || again=(--reconfigure)
# Inlined functions have no lines of their own.
meson setup "${again[@]}" "$build" -Db_coverage=true -Doptimization=0 -Ddebug=true -Dwerror=false \
  -Dtests=enabled -Dscene=enabled >"$build.log" || { tail -n 20 "$build.log" >&2; exit 1; }
tests=("$@")
if [ "$#" -eq 0 ]; then
  mapfile -t tests < <(meson test -C "$build" --list 2>/dev/null | sed 's|.* / ||' |
    grep -Ev 'valgrind|install|package|evaluation|examples|pages|codecs|bench|soak|stability|random-windows|archive|^memory$')
fi
find "$build" -name '*.gcda' -delete
# A test that fails, for want of speed, has run its lines all the same.
meson test -C "$build" --timeout-multiplier 10 --num-processes "$(nproc)" "${tests[@]}" || true
gcovr --root . --filter 'core/' --filter 'gst/' --exclude 'core/metrics/' \
  --gcov-ignore-parse-errors --exclude-throw-branches -j "$(nproc)" "$build" >"$build/coverage.txt"
cat "$build/coverage.txt"
