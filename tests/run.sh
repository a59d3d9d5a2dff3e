#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Installs what is missing, builds, checks the formatting and runs every test, and the short form of
# the sanitizers.
#
#   tests/run.sh          all of it: most of an hour where nothing is built yet
#   tests/run.sh --fast   after each small change, less than two minutes where the rest is built:
#                         the formatting of changed files, and the tests of meson's suite `fast`
#   tests/run.sh --help   prints this
#
#   QDMD_TEST_PACKAGE=1   compiles the Debian packages from their source, too: minutes more
#   QDMD_TEST_INSTALL=1   as root: installs the packages on this machine and removes them again
set -euo pipefail
cd "$(dirname "$0")/.."

usage() { sed -n '3,/^set/s/^# \?//p' tests/run.sh; }
fast=no
if [ "$#" -gt 1 ]; then
  echo "tests/run.sh takes one flag at most, and was given $#: see tests/run.sh --help." >&2
  exit 2
fi
case "${1-none}" in
  none) ;;
  --fast) fast=yes ;;
  --help) usage; exit 0 ;;
  *)
    echo "tests/run.sh has no flag \"$1\": it knows --fast and --help." >&2
    exit 2 ;;
esac

groups=(build test)
[ "$fast" = yes ] || groups+=(package)
tests/install-dependencies.sh "${groups[@]}"

echo "== formatting"
formatted=yes
list_sources() {
  if [ "$fast" = no ]; then
    find core gst examples tests -name '*.cpp' -o -name '*.h'
    return
  fi
  # Of a tarball nobody knows what was changed.
  { git diff --name-only --diff-filter=d HEAD; git ls-files --others --exclude-standard; } 2>/dev/null |
    grep -E '^(core|gst|examples|python|tests)/.*\.(cpp|h)$' || true
}
mapfile -t sources < <(list_sources)
if [ "${#sources[@]}" -gt 0 ] && ! clang-format --dry-run --Werror "${sources[@]}"; then
  echo "Run clang-format -i on the files above." >&2
  formatted=no
fi

echo "== build"
# The folder may have been configured before the packages for the tests were there.
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
# Where it is configured already, ninja sees by itself what changed.
[ "$fast" = yes ] && [ -f build/build.ninja ] ||
  meson setup "${again[@]}" build -Dtests=enabled -Dscene=enabled
targets=()
if [ "$fast" = yes ]; then
  # Regenerates what meson knows of the tests.
  ninja -C build build.ninja >/dev/null
  mapfile -t targets < <(meson introspect build --tests | /usr/bin/python3 -c '
import json, os, sys
programs = {os.path.relpath(test["cmd"][0], os.path.abspath("build"))
            for test in json.load(sys.stdin) if any(s.split(":")[-1] == "fast" for s in test["suite"])}
# Scripts need not be built.
programs = sorted(program for program in programs if not program.startswith(".."))
print("gst/libgstqdmd.so", *programs, sep="\n")')
fi
ninja -C build -j "$(tests/jobs.sh)" "${targets[@]}"

echo "== test"
rm -f build/meson-logs/testlog.junit.xml
status=0
suite=()
[ "$fast" = no ] || suite=(--suite fast)
meson test -C build --no-rebuild --print-errorlogs "${suite[@]}" || status=$?
read -r passed _ failed _ skipped _ <<<"$(tests/count_results.py build)"
# A program that dies without a report of its own is a failure too.
[ "$status" -eq 0 ] || [ "$failed" -gt 0 ] || failed=1

if [ "$fast" = no ]; then
  echo "== sanitizers"
  if tests/sanitize.sh; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
fi
if [ "$formatted" = yes ]; then passed=$((passed + 1)); else failed=$((failed + 1)); fi

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
