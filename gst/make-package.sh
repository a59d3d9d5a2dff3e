#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Builds the Debian packages with `dpkg-buildpackage -b -us -uc`, some minutes of compiling: the plugins, the
# library and its headers, the module for Python, and the tools.
#
#   gst/make-package.sh [--arch ARCH] [FOLDER]
#
#   FOLDER   where the .deb files go; build/package if not given
#   ARCH     another processor as Debian names it, `arm64`: cross-built. What that needs is installed, too,
#            which is best done in a root of its own (tests/distribution.sh SUITE arm64-packages)
set -euo pipefail
usage() { sed -n '3,/^set/{/^set/d;s/^# \?//p}' "$0"; }
arch=
if [ "${1-}" = --arch ] && [ "$#" -ge 2 ]; then
  arch=$2
  shift 2
fi
if [ "$#" -gt 1 ] || [[ ${1-} == -* ]]; then
  usage >&2
  exit 2
fi
folder=$(realpath -m "${1:-$(dirname "$0")/../build/package}")
cd "$(dirname "$0")/.."

# Always the same folder, and the cache of this user, not of the home that debhelper makes: ccache then knows what it has
# compiled.
if command -v ccache >/dev/null; then
  CCACHE_DIR=$(ccache --get-config cache_dir)
  export CCACHE_DIR
fi
work=$PWD/build/package-work
rm -rf "$work"
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/gst-qdmd"
cp -r meson.build meson_options.txt README.md LICENSE core gst python tests examples docs "$work/gst-qdmd"
# dpkg wants the folder at the top, where this project does not keep it.
mv "$work/gst-qdmd/gst/debian" "$work/gst-qdmd/debian"
cd "$work/gst-qdmd"
jobs=$(tests/jobs.sh)
if [ -z "$arch" ]; then
  tests/install-dependencies.sh build package
  dpkg-buildpackage -b -us -uc --jobs="$jobs"
else
  as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" dpkg --add-architecture "$arch"
  "${as_root[@]}" apt-get update -q
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends \
    "crossbuild-essential-$arch"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get build-dep -q -y --no-install-recommends \
    --host-architecture "$arch" --build-profiles cross ./
  # debhelper names the compilers by their paths: ccache has its own for them.
  PATH=/usr/lib/ccache:$PATH DEB_BUILD_OPTIONS=nocheck \
    dpkg-buildpackage -b -us -uc --host-arch "$arch" -Pcross,nocheck --jobs="$jobs"
fi

mkdir -p "$folder"
rm -f "$folder"/*qdmd*.deb
mv "$work"/*.deb "$folder"
ls "$folder"/*.deb
