#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the tables of docs/notebook/robust.md, and its pictures, anew. Needs the sequences: QDMD_DATA names the
# folder that has SBI, SBMnet and CDnet. Takes some twenty minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"
need_sequences

tests/install-dependencies.sh build test demo
build gst/libgstqdmd.so gst/libgstqdmdscene.so tests/evaluation/qdmd-evaluate \
  tests/evaluation/qdmd-robust-ablation

rm -rf "$results"
mkdir -p "$results"
evaluate=(build/tests/evaluation/qdmd-evaluate --in-process)
at_most=(--dataset "$QDMD_DATA" --jobs 1 --thin 300 --format json)

echo "== methods" >&2
"${evaluate[@]}" "${at_most[@]}" >"$results/whole.json"
echo "== orders and rates" >&2
"${evaluate[@]}" "${at_most[@]}" --methods robust --reverse >"$results/reversed.json"
"${evaluate[@]}" "${at_most[@]}" --methods robust --every 2 >"$results/every-second.json"
echo "== ablation" >&2
build/tests/evaluation/qdmd-robust-ablation --dataset "$QDMD_DATA" >"$results/ablation.md"
echo "== constants" >&2
QDMD_DATA="" /usr/bin/python3 tests/evaluation/learning_constants.py >"$results/constants.md"

# Frames of the sequences may not be shown; simulated ones and Debian's street scene may.
echo "== pictures" >&2
# sheet NAME PICTURE: of the methods' backgrounds at the middle or last frame, as
# docs/images/robust-NAME.jpg.
sheet() {
  # Without truth it ends with 1.
  "${evaluate[@]}" --dataset "$results/$1" --methods robust,qdmd,dmd,median \
    --picture "$2" --output-dir "$results/$1-out" >/dev/null || [ -f "$results/$1-out/$1_sheet.png" ]
  shrink "$results/$1-out/$1_sheet.png" 1400 "docs/images/robust-$1.jpg"
}
# 20 seconds of a scene in which a bag is left, and of one in which the light fades.
caps="video/x-raw,width=320,height=240,framerate=5/1"
for scene in abandon fade; do
  folder=$results/$scene
  mkdir -p "$folder/input" "$folder/gt"
  effects=$scene picture=middle frames=50
  [ "$scene" != fade ] || { effects="basic,fade=0.4:duration=20" picture=last frames=100; }
  gst-launch-1.0 -q qdmdscenesrc scene="$effects" seed=7 num-buffers=100 ! $caps ! videoconvert ! \
    pngenc ! multifilesink location="$folder/input/%06d.png"
  # Every frame is written over the one before: the one that is scored stays.
  gst-launch-1.0 -q qdmdscenesrc scene="$effects" seed=7 truth=background num-buffers="$frames" ! $caps ! \
    videoconvert ! pngenc ! multifilesink location="$folder/gt/GT_$scene.png"
  sheet "$scene" "$picture"
done
video=$(street_video)
if [ -n "$video" ]; then
  frames_of "$video" "$results/street/input"
  sheet street middle
fi

/usr/bin/python3 tests/pages/robust_page.py docs/notebook/robust.md "$results"
