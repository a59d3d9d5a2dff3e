#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Makes all generated tables, plots and pictures of the documentation anew from one tree, some three
# hours of an idle machine with two cores. Needs the sequences: QDMD_DATA names their folder.
#
#   tests/pages/all.sh              all: times first
#   tests/pages/all.sh times        what is to run alone: pages that say how long something takes
#   tests/pages/all.sh quality      what can share the machine
#   tests/pages/all.sh masks speed  these pages
#
# build/all has what each page's script said. Each begins without results of earlier runs. Left out:
# reliability.sh, whose logs are runs of hours, and window_on_disk.sh, which needs a disk of its own.
set -uo pipefail
source "$(dirname "$0")/common.sh"

times="speed performance accuracy formats numerics stabilize archive"
quality="element scenes sampling spectrum python pipelines pictures evaluation stream objects robust masks"
case "${1:-all}" in
  all) pages="$times $quality" ;;
  times) pages=$times ;;
  quality) pages=$quality ;;
  *) pages=$* ;;
esac

for page in $pages; do
  [[ "$page" != */* && "$page" != all && -x tests/pages/$page.sh ]] ||
    { echo "No script makes a page '$page': see tests/pages." >&2; exit 2; }
done

git describe --always --dirty | tee "$results/tree"
failed=0
for page in $pages readme; do
  printf '%s %-12s' "$(date +%T)" "$page"
  begin=$SECONDS
  rm -rf "build/$page"
  if "tests/pages/$page.sh" >"$results/$page.log" 2>&1; then said=done; else said=FAILED failed=1; fi
  printf '%s, %d s\n' "$said" $((SECONDS - begin))
done
exit "$failed"
