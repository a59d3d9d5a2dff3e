#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the tables and pictures of docs/masks.md and its notebook anew. Needs the sequences: QDMD_DATA names the folder
# that has SBI, SBMnet and CDnet; QDMD_MORE one that has `fall` and `pedestrians` of CDnet. Takes about
# ten minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"
need_sequences
more=${QDMD_MORE:-../shared/measure/sequences}
[ -d "$more/fall" ] || { echo "Set QDMD_MORE to a folder that has CDnet's fall and pedestrians." >&2; exit 1; }

tests/install-dependencies.sh build test demo docs
build gst/libgstqdmd.so gst/libgstqdmdscene.so tests/evaluation/qdmd-mask-steps tests/evaluation/qdmd-mask-constants \
  tests/bench/masks

echo "== steps" >&2
build/tests/evaluation/qdmd-mask-steps --dataset "$QDMD_DATA" --dataset "$more" >"$results/steps.md"

echo "== constants" >&2
build/tests/evaluation/qdmd-mask-constants --dataset "$QDMD_DATA" --dataset "$more" --factors 0.7,1.4 \
  >"$results/constants.md"

echo "== scenes" >&2
scenes="basic intermittent-motion illumination-changes background-motion storm basic,jitter=2 basic,jitter=5
  basic,shadow basic,leaves basic,rain basic,snow basic,night basic,light-switch basic,exposure basic,bootstrap
  basic,compression basic,camouflage basic,water basic,flicker basic,abandon"
for scene in $scenes; do
  folder=$results/scenes/$scene
  mkdir -p "$folder/input" "$folder/gt/masks"
  caps="video/x-raw,format=RGB,width=320,height=240,framerate=25/1"
  render() {
    gst-launch-1.0 -q qdmdscenesrc scene="$scene" seed=3 truth="$1" num-buffers=400 ! $caps ! videoconvert ! \
      pngenc compression-level=1 ! multifilesink index=1 location="$folder/$2/%06d.png"
  }
  render none input
  render mask gt/masks
  # From the second quarter on.
  echo "101 400" >"$folder/gt/temporalROI.txt"
done
build/tests/evaluation/qdmd-mask-steps --dataset "$results/scenes" \
  --plain --only "default,mode=live,OpenCV MOG2,OpenCV KNN" >"$results/scenes.md"

echo "== cost" >&2
build/tests/bench/masks --benchmark_min_time=0.2 --benchmark_format=json \
  --benchmark_repetitions=3 --benchmark_report_aggregates_only=true >"$results/cost.json" 2>/dev/null

echo "== pictures" >&2
mkdir -p docs/images/masks
video=$(street_video)
if [ -n "$video" ]; then
  frames_of "$video" "$results/street/input"
  build/tests/evaluation/qdmd-mask-steps --dataset "$results/street" --sheet "$results/street.png" \
    --shown 30,60,90
  shrink "$results/street.png" 1400 docs/images/masks/street.jpg
  for softness in 0 2; do
    mkdir -p "$results/soft/$softness"
    gst-launch-1.0 -q filesrc location="$video" ! decodebin ! videoconvert ! videorate ! \
      video/x-raw,framerate=5/2,format=RGBA ! qdmdbackground output=cutout mask-softness=$softness ! \
      pngenc compression-level=1 ! multifilesink location="$results/soft/$softness/%03d.png"
  done
fi
for scene in basic,shadow background-motion basic,night; do
  build/tests/evaluation/qdmd-mask-steps --dataset "$results/scenes/$scene" \
    --sheet "$results/sheet-${scene//,/-}.png" --shown 200
done
/usr/bin/python3 tests/pages/masks_page.py docs/masks.md docs/notebook/masks.md "$results"
shrink "$results/scenes.png" 960 docs/images/masks/scenes.jpg
[ ! -f "$results/soft.png" ] || shrink "$results/soft.png" 1280 docs/images/masks/soft.jpg
