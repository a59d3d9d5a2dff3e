#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Makes FOLDER hold links to those of GStreamer's own plugins that are named, and nothing else:
#
#   tests/link-plugins.sh FOLDER PLUGINS NAME...
#
# As GST_PLUGIN_SYSTEM_PATH_1_0 it keeps tests from what else is in PLUGINS, where GStreamer's lie:
# some plugins do odd things when they are looked at. One that is missing is told of here, and again
# by the test that needs it.
set -euo pipefail
folder=$1
plugins=$2
shift 2
rm -rf "$folder"
mkdir -p "$folder"
for name in "$@"; do
  file="$plugins/libgst$name.so"
  if [ -e "$file" ]; then ln -s "$file" "$folder"; else echo "$name is not in $plugins"; fi
done
