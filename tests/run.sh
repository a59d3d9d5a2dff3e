#!/usr/bin/env bash
# Installs what is missing, builds, checks the formatting and runs every test, and the short form of
# the sanitizers.
#
#   QDMD_TEST_PACKAGE=1   compiles the Debian packages from their source, too: minutes more
#   QDMD_TEST_INSTALL=1   as root: installs the packages on this machine and removes them again
set -euo pipefail
cd "$(dirname "$0")/.."

tests/install-dependencies.sh build test package

# Adds up a meson test log: GoogleTest's own cases are counted, not programs.
count_results() {
  /usr/bin/python3 - "$1/meson-logs/testlog.junit.xml" <<'PYTHON'
import sys
import xml.etree.ElementTree as tree

cases = failed = skipped = 0
for case in tree.parse(sys.argv[1]).iter('testcase'):
    cases += 1
    if case.find('failure') is not None or case.find('error') is not None:
        failed += 1
    elif case.find('skipped') is not None:
        skipped += 1
print(cases - failed - skipped, failed, skipped)
PYTHON
}

echo "== formatting"
formatted=yes
mapfile -t sources < <(find core gst examples tests -name '*.cpp' -o -name '*.h')
if ! clang-format --dry-run --Werror "${sources[@]}"; then
  echo "Run clang-format -i on the files above." >&2
  formatted=no
fi

echo "== build"
# The folder may have been configured before the packages for the tests were there.
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
meson setup "${again[@]}" build -Dtests=enabled -Dscene=enabled
ninja -C build -j "$(tests/jobs.sh)"

echo "== test"
rm -f build/meson-logs/testlog.junit.xml
status=0
meson test -C build --no-rebuild --print-errorlogs || status=$?
read -r passed failed skipped <<<"$(count_results build)"
# A program that dies without a report of its own is a failure too.
[ "$status" -eq 0 ] || [ "$failed" -gt 0 ] || failed=1

echo "== sanitizers"
if tests/sanitize.sh; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
if [ "$formatted" = yes ]; then passed=$((passed + 1)); else failed=$((failed + 1)); fi

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
