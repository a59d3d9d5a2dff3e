#!/usr/bin/env bash
# Builds Debian packages of the plugins with `dpkg-buildpackage -b -us -uc`, some minutes of compiling.
#
#   gst/make-package.sh [FOLDER]      where the .deb files go; build/package if not given
set -euo pipefail
folder=$(realpath -m "${1:-$(dirname "$0")/../build/package}")
cd "$(dirname "$0")/.."

tests/install-dependencies.sh build package

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/gst-qdmd"
cp -r meson.build meson_options.txt README.md LICENSE core gst tests examples docs "$work/gst-qdmd"
# dpkg wants the folder at the top, where this project does not keep it.
mv "$work/gst-qdmd/gst/debian" "$work/gst-qdmd/debian"
(cd "$work/gst-qdmd" && dpkg-buildpackage -b -us -uc)

mkdir -p "$folder"
rm -f "$folder"/gstreamer1.0-qdmd*.deb
mv "$work"/*.deb "$folder"
ls "$folder"/*.deb
