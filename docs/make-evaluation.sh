#!/usr/bin/env bash
# Puts the tables and pictures of docs/evaluation.md anew. Needs the sequences: QDMD_DATA names the
# folder that has SBI, SBMnet and CDnet. Takes a few minutes; stopped and started again, it goes on
# where it was. Backgrounds and contact sheets stay in build/evaluation.
set -euo pipefail
cd "$(dirname "$0")/.."

if [ -z "${QDMD_DATA:-}" ] && [ -d ../shared/data ]; then QDMD_DATA=$(cd ../shared/data && pwd); fi
[ -d "${QDMD_DATA:-}/SBI" ] ||
  { echo "Set QDMD_DATA to the folder that has SBI, SBMnet and CDnet." >&2; exit 1; }

tests/install-dependencies.sh build test demo
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
meson setup "${again[@]}" build -Dtests=enabled >/dev/null
ninja -C build gst/libgstqdmd.so tests/evaluation/qdmd-evaluate

results=build/evaluation
mkdir -p "$results/tables"
export GST_REGISTRY_1_0="$PWD/$results/registry.bin"

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

# The only pictures that may be shown here: Debian's street scene. It has no truth, which the
# program says and ends with 1.
street=$results/street
video=$QDMD_DATA/videos/vtest.avi
[ -f "$video" ] || video=build/vtest.avi
if [ -f "$video" ]; then
  mkdir -p "$street/input"
  gst-launch-1.0 -q filesrc location="$video" ! decodebin ! videoconvert ! videorate ! \
    video/x-raw,framerate=5/2 ! jpegenc quality=95 ! multifilesink location="$street/input/%06d.jpg"
  build/tests/evaluation/qdmd-evaluate --dataset "$street" --methods robust,qdmd,median,mog2 \
    --output-dir "$street/out" >/dev/null || [ -f "$street/out/street_sheet.png" ]
  gst-launch-1.0 -q filesrc location="$street/out/street_sheet.png" ! pngdec ! videoconvert ! \
    videoscale method=lanczos ! video/x-raw,width=1200,pixel-aspect-ratio=1/1 ! \
    jpegenc quality=82 ! filesink location=docs/images/evaluation-street.jpg
fi

/usr/bin/python3 docs/evaluation_page.py docs/evaluation.md docs/paper-tables.csv \
  docs/images/evaluation-spread.svg "$results/tables"
