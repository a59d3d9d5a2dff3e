#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Makes the pictures of examples/pipelines.md from simulated scenes.
set -euo pipefail
source "$(dirname "$0")/common.sh"

tests/install-dependencies.sh build test
build gst/libgstqdmd.so gst/libgstqdmdscene.so

pictures=docs/images/pipelines
mkdir -p "$pictures"
caps="video/x-raw,format=RGBA,width=320,height=240"
source="qdmdscenesrc scene=basic,shadow effects=bootstrap=2 seed=3 num-buffers=100 ! $caps"
# Every frame is written over the one before.
picture="videoconvert ! jpegenc quality=75 ! multifilesink"
long="queue max-size-buffers=0 max-size-bytes=0 max-size-time=0"

gst-launch-1.0 -q $source ! tee name=t \
  compositor name=side sink_1::xpos=320 sink_2::ypos=240 sink_3::xpos=320 sink_3::ypos=240 ! \
  videoscale method=lanczos ! video/x-raw,width=480,height=360 ! \
  $picture location="$pictures/outputs.jpg" \
  t. ! $long ! side.sink_0 \
  t. ! qdmdseparate name=s \
  s.background ! $long ! side.sink_1 \
  s.foreground ! $long ! side.sink_2 \
  s.mask ! $long ! side.sink_3

# What is linked to the compositor first lies below.
gst-launch-1.0 -q compositor name=over sink_0::repeat-after-eos=true ! \
  $picture location="$pictures/over.jpg" \
  qdmdscenesrc seed=5 truth=background num-buffers=1 ! $caps ! over.sink_0 \
  $source ! qdmdbackground output=cutout ! over.sink_1
ls -l "$pictures"
