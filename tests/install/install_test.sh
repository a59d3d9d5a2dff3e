#!/usr/bin/env bash
# Installs what BUILD holds below a temporary root, tries it there and uninstalls it:
# install_test.sh BUILD FOLDER FILE..., where FOLDER is to hold exactly the plugins FILE.
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
diff <(printf "$root$folder/%s\n" "$@" | sort) <(find "$root" ! -type d | sort)
"$tests/try_plugin.sh" "$root$folder"
grep -F "GST_PLUGIN_PATH=$folder" "$build/meson-logs/meson-log.txt"

echo "== uninstall"
ninja -C "$build" uninstall
diff /dev/null <(find "$root" -mindepth 1)

echo "== devenv"
mkdir "$work/cache"
XDG_CACHE_HOME="$work/cache" meson devenv -C "$build" gst-inspect-1.0 qdmdbackground |
  grep -F "$build/gst/libgstqdmd.so"
# The user's registry is left alone.
diff /dev/null <(find "$work/cache" -mindepth 1)
