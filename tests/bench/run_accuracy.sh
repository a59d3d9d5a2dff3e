#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs the short form of accuracy-cost, run_accuracy.sh PROGRAM, and then once more: a table that is
# whole, but for a last line cut off, is continued with that line alone.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$1" --short "$folder/table.csv"
for part in budget error scaling quality; do grep -q "^$part," "$folder/table.csv"; done
sort "$folder/table.csv" | cut -d, -f1-11 >"$folder/rows"
truncate -s -3 "$folder/table.csv"
"$1" --short "$folder/table.csv" 2>"$folder/log" || { cat "$folder/log"; exit 1; }
cat "$folder/log"
grep -q '^1 new rows' "$folder/log"
sort "$folder/table.csv" | cut -d, -f1-11 | diff "$folder/rows" -
