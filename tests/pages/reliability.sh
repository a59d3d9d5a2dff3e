#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the figures of docs/notebook/reliability.md anew, from the logs of runs that took hours:
#
#   tests/fuzz.sh --runs 1000000                          leaves build-fuzz/TARGET.log; those of several
#                                                         runs may be joined to one
#   build/tests/fuzz/fuzz-TARGET --random N --seed 77     a line each, by hand, in build/random.log
#   GST_PLUGIN_PATH=build/gst build/tests/soak/soak --long >build/soak.log
#   tests/mutate.py --count 40 >build/mutation.log
#   tests/mutate.py --missed build/mutation.log >build/mutation-again.log
#   tests/mutate.py --seed 2 >build/mutation-2.log, and so on
#   tests/coverage.sh                                     leaves build-coverage/coverage.txt
#
# Where there is no log, the page says so.
set -euo pipefail
source "$(dirname "$0")/common.sh"

# block NAME LOG...: the last lines of each log as they are, or that there is none.
block() {
  local name=$1 log
  shift
  {
    echo
    for log in "$@"; do
      if [ -s "$log" ]; then
        printf '```\n%s:\n%s\n```\n' "$(basename "$log")" "$(lines_of "$name" "$log")"
      else
        printf 'Not run on this tree: no `%s`.\n' "$log"
      fi
    done
    echo
  } >"$results/$name.md"
}
lines_of() {
  case "$1" in
    fuzz)
      grep -aE 'DONE|Done|stat::number_of|stat::average|ERROR|SUMMARY' "$2" | tail -n 5
      awk '/stat::number_of/ { sum += $2; ++runs }
           END { if (runs > 1) print "sum of " runs " runs: " sum " executions" }' "$2"
      ;;
    coverage) grep -E '^TOTAL' "$2" ;;
    random) cat "$2" ;;
    mutation) grep -E '^MISSED|noticed$' "$2" ;;
    *) tail -n 41 "$2" ;;
  esac | cut -c1-150
}

block fuzz build-fuzz/{scene,learnt,dataset,core,element}.log
block random build/random.log
block soak build/soak.log
block mutation build/mutation{,-again,-2,-2-again,-3,-3-again}.log
block coverage build-coverage/coverage.txt
names=()
for name in fuzz random soak mutation coverage; do names+=("$name=$results/$name.md"); done
/usr/bin/python3 tests/pages/page.py docs/notebook/reliability.md "${names[@]}"
