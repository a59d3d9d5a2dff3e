#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Installs what BUILD holds below a temporary root, tries it there and uninstalls it:
# install_test.sh BUILD FOLDER FILE..., where FOLDER is to hold exactly the plugins FILE, beside LIBRARY_FILES.
set -euo pipefail
tests=$(realpath "$(dirname "$0")")
build=$1
folder=$2
shift 2
work=$(mktemp -d)
root="$work/root"
mkdir "$root"

# It is what `ninja uninstall` goes by: whoever has installed this build keeps theirs.
log="$build/meson-logs/install-log.txt"
[ ! -f "$log" ] || cp -p "$log" "$work/log"
finish() {
  if [ -f "$work/log" ]; then cp -p "$work/log" "$log"; else rm -f "$log"; fi
  rm -rf "$work"
}
trap finish EXIT

echo "== install"
meson install -C "$build" --no-rebuild --destdir "$root"
read -ra library <<<"${LIBRARY_FILES:-}"
diff <({ printf "$root$folder/%s\n" "$@"; printf "$root%s\n" ${library[@]+"${library[@]}"}; } | grep -v "^$root$" |
  sort) <(find "$root" ! -type d | sort)
"$tests/try_plugin.sh" "$root$folder"
grep -F "GST_PLUGIN_PATH=$folder" "$build/meson-logs/meson-log.txt"

pc=$(printf '%s\n' ${library[@]+"${library[@]}"} | grep 'qdmd[.]pc$' || true)
if [ -n "$pc" ]; then
  echo "== a program that uses the library"
  # pkg-config puts the root in front of qdmd's folders and of OpenCV's.
  flags=$(PKG_CONFIG_PATH="$root$(dirname "$pc")" pkg-config --define-variable=prefix="$root$(dirname "$pc" | sed 's,/lib.*,,')" \
    --cflags --libs qdmd)
  # shellcheck disable=SC2086
  c++ -std=c++17 "$tests/../../examples/subtract.cpp" -o "$work/subtract" $flags \
    $(pkg-config --cflags opencv4) -lopencv_core -lopencv_imgcodecs -lopencv_videoio -lopencv_video
  mkdir "$work/frames"
  # With all of GStreamer's elements: tests have those that they need.
  env -u GST_PLUGIN_SYSTEM_PATH_1_0 GST_REGISTRY_1_0="$work/registry.bin" gst-launch-1.0 -q \
    videotestsrc pattern=ball num-buffers=30 ! video/x-raw,width=160,height=120 ! videoconvert ! pngenc ! \
    multifilesink location="$work/frames/%04d.png"
  LD_LIBRARY_PATH="$root$(dirname "$(dirname "$pc")")" "$work/subtract" "$work/frames/%04d.png" "$work/background.png" \
    "$work/mask.png" | grep -Fx '30 frames'
  [ -s "$work/background.png" ] && [ -s "$work/mask.png" ]
fi

echo "== uninstall"
ninja -C "$build" uninstall
diff /dev/null <(find "$root" -mindepth 1)

echo "== devenv"
mkdir "$work/cache"
XDG_CACHE_HOME="$work/cache" meson devenv -C "$build" gst-inspect-1.0 qdmdbackground |
  grep -F "$build/gst/libgstqdmd.so"
# The user's registry is left alone.
diff /dev/null <(find "$work/cache" -mindepth 1)
