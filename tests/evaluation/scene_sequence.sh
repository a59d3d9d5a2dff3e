#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Writes a simulated scene as a sequence for qdmd-evaluate, its frames as x264 leaves them:
#
#   scene_sequence.sh FOLDER SCENE [KBIT/S [FRAMES]]
#
# FOLDER/input has the frames (100 kbit/s and 200 frames where nothing is said; 0 kbit/s: without the
# encoder), FOLDER/groundtruth the labels and FOLDER/gt the background of the middle frame, which
# qdmd-evaluate scores; both are those of the scene before the encoder. An encoder remembers frames, so
# that none follows from its number alone: it can be no effect of the scene.
set -euo pipefail
usage() { sed -n '3,/^set/{/^set/d;s/^# \?//;s/scene_sequence.sh/'"$(basename "$0")/;p}" "$0"; }
if [ "${1-}" = --help ]; then
  usage
  exit
elif [ $# -lt 2 ]; then
  usage >&2
  exit 2
fi
folder=$1 scene=$2 rate=${3:-100} frames=${4:-200}
# In the project's folder, the plugins of its build folder.
built=$(dirname "$(realpath "$0")")/../../build/gst
[ ! -d "$built" ] || export GST_PLUGIN_PATH_1_0="${GST_PLUGIN_PATH_1_0:-$built}"

# Several threads would share out the bits in another way on each machine. I420 is what cameras send;
# straight from there to RGB videoconvert is quick and 3.5 levels too dark, by way of 16 bits it is not.
codec="videoconvert ! video/x-raw,format=I420 ! x264enc bitrate=$rate key-int-max=50 threads=1 ! \
  decodebin ! videoconvert ! video/x-raw,format=ARGB64 !"
[ "$rate" != 0 ] || codec=
source="qdmdscenesrc scene=$scene"
caps="video/x-raw,format=RGB,width=320,height=240,framerate=25/1"

rm -rf "$folder/input" "$folder/groundtruth" "$folder/gt"
mkdir -p "$folder/input" "$folder/groundtruth" "$folder/gt"
# shellcheck disable=SC2086
gst-launch-1.0 -q \
  $source num-buffers="$frames" ! $caps ! $codec videoconvert ! pngenc ! \
  multifilesink index=1 location="$folder/input/in%06d.png" \
  $source num-buffers="$frames" truth=labels ! $caps ! pngenc ! \
  multifilesink index=1 location="$folder/groundtruth/gt%06d.png"
# A scene may end before.
frames=$(find "$folder/input" -name '*.png' | wc -l)
# Every background is written over the one before.
# shellcheck disable=SC2086
gst-launch-1.0 -q $source num-buffers=$(((frames + 1) / 2)) truth=background ! $caps ! pngenc ! \
  multifilesink location="$folder/gt/GT_background.png"
