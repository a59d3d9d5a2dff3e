#!/usr/bin/env bash
# Puts the tables and plots of docs/accuracy-vs-time.md anew, in less than half an hour on two idle
# cores. Real sequences need QDMD_DATA, the folder that has SBI, SBMnet and CDnet; without it there
# are simulated scenes alone. The table stays in build/accuracy.
#
#   docs/make-accuracy.sh [--resume | --short | --page]
#
# --resume: what is in the table is not measured again. --short: a minute, to try the script, whose
# page is build/accuracy/short/page.md. --page: from the table of last time.
set -euo pipefail
cd "$(dirname "$0")/.."

form=${1:-whole}
results=build/accuracy page=docs/accuracy-vs-time.md plots=docs/images/accuracy options=()
case "$form" in
  whole | --resume | --page) ;;
  --short)
    results=build/accuracy/short page=$results/page.md plots=$results options=(--short)
    ;;
  *) echo "usage: docs/make-accuracy.sh [--resume | --short | --page]" >&2; exit 2 ;;
esac
if [ -z "${QDMD_DATA:-}" ] && [ -d ../shared/data ]; then QDMD_DATA=$(cd ../shared/data && pwd); fi
[ ! -d "${QDMD_DATA:-}" ] || export QDMD_DATA

tests/install-dependencies.sh build test docs
mkdir -p "$results" "$plots"
[ "$form" != --short ] || cp docs/accuracy-vs-time.md "$page"

if [ "$form" != --page ]; then
  again=()
  [ ! -f build/build.ninja ] || again=(--reconfigure)
  meson setup "${again[@]}" build -Dtests=enabled >/dev/null
  ninja -C build tests/bench/accuracy-cost
  if [ "$form" != --resume ]; then rm -f "$results/table.csv" "$results/seconds"; fi
  export GST_REGISTRY_1_0="$PWD/$results/registry.bin"
  uptime >"$results/load-before"
  # Of all runs that the table comes from.
  before=$(cat "$results/seconds" 2>/dev/null || echo 0)
  trap 'echo $((before + SECONDS)) >"$results/seconds"' EXIT
  build/tests/bench/accuracy-cost "${options[@]}" "$results/table.csv"
  uptime >"$results/load-after"
  echo $((before + SECONDS)) >"$results/seconds"
  trap - EXIT
fi

/usr/bin/python3 docs/accuracy_page.py "$page" "$plots" "$results"
