#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the tables and plots of docs/accuracy-vs-time.md and its notebook anew, in less than half an hour on two
# idle cores. Real sequences need QDMD_DATA, the folder that has SBI, SBMnet and CDnet; without it there
# are simulated scenes alone. The table stays in build/accuracy.
#
#   tests/pages/accuracy.sh [--resume | --short | --page]
#
# --resume: what is in the table is not measured again. --short: a minute, to try the script, whose
# pages are build/accuracy/short/{page,notebook}.md. --page: from the table of last time.
set -euo pipefail
source "$(dirname "$0")/common.sh"

form=${1:-whole}
page=docs/accuracy-vs-time.md notebook=docs/notebook/accuracy-vs-time.md plots=docs/images/accuracy options=()
case "$form" in
  whole | --resume | --page) ;;
  --short)
    results=$results/short page=$results/page.md notebook=$results/notebook.md plots=$results options=(--short)
    ;;
  *) echo "usage: tests/pages/accuracy.sh [--resume | --short | --page]" >&2; exit 2 ;;
esac
find_sequences

tests/install-dependencies.sh build test docs
mkdir -p "$results" "$plots"
if [ "$form" = --short ]; then
  cp docs/accuracy-vs-time.md "$page"
  cp docs/notebook/accuracy-vs-time.md "$notebook"
fi

if [ "$form" != --page ]; then
  build tests/bench/accuracy-cost
  if [ "$form" != --resume ]; then rm -f "$results/table.csv" "$results/seconds"; fi
  uptime >"$results/load-before"
  # Seconds of all runs that the table comes from.
  before=$(cat "$results/seconds" 2>/dev/null || echo 0)
  trap 'echo $((before + SECONDS)) >"$results/seconds"' EXIT
  build/tests/bench/accuracy-cost "${options[@]}" "$results/table.csv"
  uptime >"$results/load-after"
  echo $((before + SECONDS)) >"$results/seconds"
  trap - EXIT
fi

/usr/bin/python3 tests/pages/accuracy_page.py "$page" "$notebook" "$plots" "$results"
