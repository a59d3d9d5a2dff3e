#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Which lines of core/ and gst/ the suite runs, with clang's counters, in a folder of its own: half an
# hour to compile, and twice the time of the suite. Prints a table of files and, of each, the lines
# that are not run; build-coverage/coverage.txt keeps both.
#
#   tests/coverage.sh [TEST...]      tests by their meson names (default: all but those of packages,
#                                    pages and benchmarks, and the same lines under valgrind)
set -euo pipefail
cd "$(dirname "$0")/.."
tests/install-dependencies.sh build test coverage
build=build-coverage
again=()
[ ! -f "$build/build.ninja" ] || again=(--reconfigure)
# The counters are in before anything is optimized or inlined.
CXX="${COVERAGE_CXX:-clang++}" meson setup "${again[@]}" "$build" -Doptimization=2 -Ddebug=false \
  -Db_lundef=false -Dwerror=false -Dtests=enabled -Dscene=enabled \
  -Dcpp_args="-fprofile-instr-generate -fcoverage-mapping" \
  -Dcpp_link_args=-fprofile-instr-generate >"$build.log" || { tail -n 20 "$build.log" >&2; exit 1; }
LLVM_PROFILE_FILE=/dev/null ninja -C "$build" -j "$(tests/jobs.sh)"

tests=("$@")
if [ "$#" -eq 0 ]; then
  mapfile -t tests < <(meson test -C "$build" --list 2>/dev/null | sed 's|.* / ||' |
    grep -Ev 'valgrind|install|package|pages|docs|bench')
fi
# Processes of one program add to one file.
profiles="$PWD/$build/profiles"
rm -rf "$profiles"
# A test that fails has run its lines all the same.
LLVM_PROFILE_FILE="$profiles/%2m.profraw" meson test -C "$build" --no-rebuild \
  --timeout-multiplier 10 --num-processes "$(nproc)" "${tests[@]}" || true

cd "$build"
llvm-profdata merge --sparse --failure-mode=all profiles/*.profraw -o coverage.profdata
objects=()
while read -r object; do objects+=(-object "$object"); done < <(
  find gst core tests examples -type f -perm -u+x ! -path '*.p/*' -exec sh -c \
    'for file; do ! readelf -SW "$file" 2>/dev/null | grep -q __llvm_covmap || echo "$file"; done' sh {} +)
# Metrics are what the other tools measure with: not part of the element.
only=(--ignore-filename-regex='(^|/)(tests|examples|metrics|usr)/')
# It warns of functions with mismatched data: inline ones, in files that include and do not use them.
{
  llvm-cov report "${objects[@]:1}" -instr-profile=coverage.profdata "${only[@]}" \
    -show-region-summary=false -show-branch-summary=false -show-functions=false
  echo
  llvm-cov export "${objects[@]:1}" -instr-profile=coverage.profdata "${only[@]}" -format=lcov |
    /usr/bin/python3 ../tests/lines_not_run.py
} >coverage.txt
cat coverage.txt
