#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the tables and pictures of docs/evaluation.md and its notebook anew. Needs the sequences: QDMD_DATA names the
# folder that has SBI, SBMnet and CDnet. Takes a few minutes; stopped and started again, it goes on
# where it was. Backgrounds and contact sheets stay in build/evaluation.
set -euo pipefail
source "$(dirname "$0")/common.sh"
need_sequences

tests/install-dependencies.sh build test demo
build gst/libgstqdmd.so tests/evaluation/qdmd-evaluate

mkdir -p "$results/tables"
# evaluate NAME ARGUMENT...: a table of $results/tables, and finished jobs for the next time.
evaluate() {
  local name=$1
  shift
  echo "== $name" >&2
  build/tests/evaluation/qdmd-evaluate --dataset "$QDMD_DATA" --resume "$results/jobs" \
    --format json "$@" >"$results/tables/$name.json"
}

# Whole sequences.
rm -f "$results"/tables/*.json
evaluate whole --output-dir "$results/whole"
evaluate whole-first-frame --output-dir "$results/first-frame" --methods qdmd,dmd \
  --set amplitude=first-frame
evaluate whole-neighbours --output-dir "$results/neighbours" --methods qdmd,dmd \
  --set omega-threshold=0.01
evaluate whole-rank-1 --output-dir "$results/rank-1" --methods qdmd,dmd --set rank=1
for picture in first last median; do
  evaluate "picture-$picture" --methods qdmd,dmd --picture "$picture"
done

# 200 consecutive frames, as in the paper, from five start frames evenly spaced.
excerpt=200
for folder in "$QDMD_DATA"/{SBI,SBMnet,CDnet}/*/; do
  sequence=$(basename "$folder")
  count=$(find "$folder/input" -type f | wc -l)
  [ "$count" -gt "$excerpt" ] || continue
  for k in 0 1 2 3 4; do
    start=$(((count - excerpt) * k / 4))
    evaluate "excerpt-$sequence-$k" --sequences "$sequence" --frames "$excerpt" --start "$start" \
      --methods qdmd,dmd,median
    evaluate "excerpt-$sequence-$k-first-frame" --sequences "$sequence" --frames "$excerpt" \
      --start "$start" --methods qdmd,dmd --set amplitude=first-frame
    evaluate "excerpt-$sequence-$k-neighbours" --sequences "$sequence" --frames "$excerpt" \
      --start "$start" --methods qdmd,dmd --set omega-threshold=0.01
  done
done

# It has no truth, which the program says and ends with 1.
street=$results/street
video=$(street_video)
if [ -n "$video" ]; then
  frames_of "$video" "$street/input"
  build/tests/evaluation/qdmd-evaluate --dataset "$street" --methods robust,qdmd,median,mog2 \
    --output-dir "$street/out" >/dev/null || [ -f "$street/out/street_sheet.png" ]
  shrink "$street/out/street_sheet.png" 1200 docs/images/evaluation-street.jpg
fi

/usr/bin/python3 tests/pages/evaluation_page.py docs/evaluation.md docs/notebook/evaluation.md \
  tests/pages/paper-tables.csv docs/images/evaluation-spread.svg "$results/tables"
