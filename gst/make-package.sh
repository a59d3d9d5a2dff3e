#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Builds the Debian packages with `dpkg-buildpackage -b -us -uc`, some minutes of compiling: the plugins, the
# library and its headers, the module for Python, and the tools.
#
#   gst/make-package.sh [FOLDER]      where the .deb files go; build/package if not given
set -euo pipefail
folder=$(realpath -m "${1:-$(dirname "$0")/../build/package}")
cd "$(dirname "$0")/.."

tests/install-dependencies.sh build package

# Always the same folder: ccache then knows what it has compiled.
work=$PWD/build/package-work
rm -rf "$work"
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/gst-qdmd"
cp -r meson.build meson_options.txt README.md LICENSE core gst python tests examples docs "$work/gst-qdmd"
# dpkg wants the folder at the top, where this project does not keep it.
mv "$work/gst-qdmd/gst/debian" "$work/gst-qdmd/debian"
(cd "$work/gst-qdmd" && dpkg-buildpackage -b -us -uc --jobs="$(tests/jobs.sh)")

mkdir -p "$folder"
rm -f "$folder"/*qdmd*.deb
mv "$work"/*.deb "$folder"
ls "$folder"/*.deb
