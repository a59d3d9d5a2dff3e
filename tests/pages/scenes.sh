#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Makes docs/scenes.md's reference, its pictures (frame, true background and mask by three sources of
# one seed) and the notebook's table of times anew. Takes some minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"

tests/install-dependencies.sh build test
build gst/libgstqdmdscene.so tests/scenes/scene-table tests/bench/scene

build/tests/scenes/scene-table >"$results/reference.md"

# The frame at which a scene shows what it is about; 60 where nothing else is said.
frame_of() {
  case "$1" in
    low-framerate) echo 2 ;;
    low-rate | very-short) echo 4 ;;
    trees | dynamic-background) echo 40 ;;
    abandon) echo 90 ;;
    remove | intermittent-motion | intermittent-object-motion) echo 190 ;;
    stand | leave) echo 110 ;;
    boat) echo 210 ;;
    fog) echo 130 ;;
    bands) echo 61 ;;
    fade) echo 180 ;;
    light-switch | illumination-changes) echo 135 ;;
    exposure) echo 100 ;;
    lamp) echo 130 ;;
    headlights) echo 90 ;;
    cloud | infrared) echo 170 ;;
    *) echo 60 ;;
  esac
}

mkdir -p docs/images/scenes
mapfile -t names < <(sed -nE 's/^\| \*\*`([a-z-]+)`.*/\1/p' "$results/reference.md")
for name in "${names[@]}"; do
  printf '\rpictures: %-24s' "$name" >&2
  effects=
  # The gain is only seen where the light changes.
  [ "$name" != exposure ] || effects=effects=light-switch
  source="qdmdscenesrc scene=$name $effects seed=7 num-buffers=$(($(frame_of "$name") + 1))"
  caps="video/x-raw,width=320,height=240"
  # Every frame is written over the one before.
  # The compositor would take the size of the result for its own, and cut off what is outside.
  gst-launch-1.0 -q compositor name=side sink_1::xpos=320 sink_2::xpos=640 ! \
    video/x-raw,width=960,height=240 ! videoconvert ! videoscale method=lanczos ! \
    video/x-raw,width=720,height=180,pixel-aspect-ratio=1/1 ! \
    jpegenc quality=80 ! multifilesink location="docs/images/scenes/$name.jpg" \
    $source ! $caps ! side.sink_0 \
    $source truth=background ! $caps ! side.sink_1 \
    $source truth=mask ! $caps ! side.sink_2
done
echo >&2

build/tests/bench/scene --benchmark_repetitions=5 --benchmark_report_aggregates_only=true \
  --benchmark_enable_random_interleaving=true --benchmark_min_time=0.05 \
  --benchmark_format=json >"$results/times.json"

/usr/bin/python3 tests/pages/scenes_page.py docs/scenes.md docs/notebook/scenes.md "$results"
