#!/usr/bin/env bash
# Installs what is missing, builds, checks the formatting and runs every test.
#
#   tests/run.sh [--sanitize]
#
# --sanitize also builds with the address and undefined-behaviour sanitizers (in build-sanitize) and
# runs the core tests there; this takes several minutes more.
#
# QDMD_DATA names the folder of real sequences; tests that need one are skipped without it.
set -euo pipefail
cd "$(dirname "$0")/.."

sanitize=no
for argument in "$@"; do
  case "$argument" in
    --sanitize) sanitize=yes ;;
    *) echo "usage: tests/run.sh [--sanitize]" >&2; exit 2 ;;
  esac
done

tests/install-dependencies.sh build test

passed=0 failed=0 skipped=0

# Adds a meson test log's outcome to the totals. GoogleTest's own cases are counted, not programs.
count_results() {
  local report=$1/meson-logs/testlog.junit.xml numbers
  numbers=$(/usr/bin/python3 - "$report" <<'PYTHON'
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
  )
  read -r p f s <<<"$numbers"
  passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
}

# Configures, builds and tests in folder $1 with meson options $2..; a failure is counted.
build_and_test() {
  local folder=$1 suite=$2
  shift 2
  local again=()
  # The folder may have been configured before the packages for the tests were there.
  [ ! -f "$folder/build.ninja" ] || again=(--reconfigure)
  meson setup "${again[@]}" "$folder" -Dtests=enabled "$@"
  ninja -C "$folder"
  rm -f "$folder/meson-logs/testlog.junit.xml"
  local status=0
  meson test -C "$folder" --no-rebuild --print-errorlogs $suite || status=$?
  count_results "$folder"
  if [ "$status" -ne 0 ] && [ "$failed" -eq 0 ]; then failed=1; fi
}

echo "== formatting"
mapfile -t sources < <(git ls-files '*.cpp' '*.h')
if clang-format --dry-run --Werror "${sources[@]}"; then
  passed=$((passed + 1))
else
  echo "Run clang-format -i on the files above." >&2
  failed=$((failed + 1))
fi

echo "== build and test"
build_and_test build ""
if [ "$sanitize" = yes ]; then
  echo "== sanitizers"
  build_and_test build-sanitize "--suite core" -Db_sanitize=address,undefined -Dbuildtype=debugoptimized
fi

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
