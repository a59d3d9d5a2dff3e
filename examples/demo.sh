#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Builds the project and separates a video: a street scene, or the one that is named.
#
#   examples/demo.sh [VIDEO]
#
# Installs what is missing (as root or through sudo) and writes to build/demo.
set -euo pipefail
video=${1:-}
[ -z "$video" ] || video=$(realpath -e -- "$video" 2>/dev/null) ||
  { echo "There is no such video: $1" >&2; exit 1; }
cd "$(dirname "$0")/.."

tests/install-dependencies.sh build demo

# The folder may have been configured before the packages for the demo were there.
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
meson setup "${again[@]}" build -Dexamples=enabled -Dscene=enabled
jobs=$(tests/jobs.sh)
echo "Compiling takes some minutes ($jobs at once: each compiler needs up to 2 GB of memory)"
ninja -C build -j "$jobs" gst/libgstqdmd.so gst/libgstqdmdscene.so examples/qdmd-demo

demo=build/demo
mkdir -p "$demo"

# Takes the street scene out of Debian's opencv-doc package, once.
fetch_street_scene() {
  local folder=build/opencv-doc
  rm -rf "$folder" && mkdir -p "$folder"
  (cd "$folder" && apt-get download -q opencv-doc) >"$folder/log" 2>&1 || return 1
  dpkg-deb -x "$folder"/opencv-doc_*.deb "$folder/unpacked" || return 1
  local found
  found=$(find "$folder/unpacked" \( -name vtest.avi -o -name vtest.avi.gz \) -print -quit)
  case "$found" in
    *.gz) gunzip -c "$found" >"$1.part" || return 1 ;;
    ?*) cp "$found" "$1.part" || return 1 ;;
    *) return 1 ;;
  esac
  mv "$1.part" "$1"
  rm -rf "$folder"
}

source=()
if [ -n "$video" ]; then
  source=("$video")
elif [ -f "${QDMD_DATA:-}/videos/vtest.avi" ]; then
  source=("$QDMD_DATA/videos/vtest.avi")
else
  cached=build/vtest.avi
  if [ ! -f "$cached" ]; then
    echo "Fetching the street scene vtest.avi from Debian's opencv-doc package"
    fetch_street_scene "$cached" ||
      echo "The street scene could not be fetched (no network?): a simulated street is shown instead."
  fi
  if [ -f "$cached" ]; then source=("$cached"); else source=(--scene basic,shadow,leaves); fi
fi

GST_PLUGIN_PATH_1_0="$PWD/build/gst" GST_REGISTRY_1_0="$PWD/build/demo-registry.bin" \
  build/examples/qdmd-demo --output-dir "$demo" "${source[@]}"
