# SPDX-License-Identifier: LGPL-2.1-or-later
# What the scripts of this folder share. It takes them to the root of the project and gives them the
# elements of build/gst. What a script measures stays in $results.

# Programs of the tests know the plugin by the path without links, and refuse another.
cd -P "$(dirname "${BASH_SOURCE[0]}")/../.."
results=build/$(basename "$0" .sh)
mkdir -p "$results"
export GST_PLUGIN_PATH_1_0="$PWD/build/gst" GST_REGISTRY_1_0="$PWD/$results/registry.bin"

# build TARGET...
build() {
  local again=()
  [ ! -f build/build.ninja ] || again=(--reconfigure)
  meson setup "${again[@]}" build -Dtests=enabled -Dscene=enabled >/dev/null
  ninja -C build "$@"
}

# Exports QDMD_DATA, the folder that has SBI, SBMnet and CDnet, if there is one.
find_sequences() {
  if [ -z "${QDMD_DATA:-}" ] && [ -d ../shared/data ]; then
    QDMD_DATA=$(cd ../shared/data && pwd)
  fi
  [ ! -d "${QDMD_DATA:-}" ] || export QDMD_DATA
}

need_sequences() {
  find_sequences
  [ -d "${QDMD_DATA:-}/SBI" ] ||
    { echo "Set QDMD_DATA to the folder that has SBI, SBMnet and CDnet." >&2; exit 1; }
}

# The file of Debian's street scene, the only recorded one whose frames may be shown. Nothing where it
# is not at hand: examples/demo.sh fetches it.
street_video() {
  local video
  for video in "${QDMD_DATA:-}/videos/vtest.avi" build/vtest.avi; do
    if [ -f "$video" ]; then echo "$video"; break; fi
  done
}

# frames_of VIDEO FOLDER: 2.5 frames of each second.
frames_of() {
  mkdir -p "$2"
  gst-launch-1.0 -q filesrc location="$1" ! decodebin ! videoconvert ! videorate ! \
    video/x-raw,framerate=5/2 ! jpegenc quality=95 ! multifilesink location="$2/%06d.jpg"
}

# shrink PNG WIDTH JPEG
shrink() {
  gst-launch-1.0 -q filesrc location="$1" ! pngdec ! videoconvert ! videoscale method=lanczos ! \
    video/x-raw,width="$2",pixel-aspect-ratio=1/1 ! jpegenc quality=82 ! filesink location="$3"
}
