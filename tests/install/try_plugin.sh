#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Asks GStreamer for the plugin in FOLDER and sends ten frames through it: try_plugin.sh FOLDER.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export GST_PLUGIN_PATH_1_0="$1" GST_REGISTRY_1_0="$work/registry.bin"

# Another one may be on this machine.
gst-inspect-1.0 qdmdbackground | grep -F "$1/libgstqdmd.so"
if [ -e "$1/libgstqdmdscene.so" ]; then
  gst-inspect-1.0 qdmdscenesrc | grep -F "$1/libgstqdmdscene.so"
fi

gst-launch-1.0 -q videotestsrc num-buffers=10 ! video/x-raw,format=RGBx,width=32,height=16 ! \
  qdmdbackground window-size=4 ! filesink location="$work/frames"
[ "$(stat -c %s "$work/frames")" -eq $((10 * 32 * 16 * 4)) ]
