#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Makes the Debian packages of the plugins and tries what is in them: package_test.sh SOURCE BUILD VERSION.
#
# The packages hold the plugins of BUILD, since compiling takes minutes; with QDMD_TEST_PACKAGE=1 all
# packages are built from SOURCE by gst/make-package.sh. With QDMD_TEST_INSTALL=1, as root, they are
# installed on this machine, used, and removed again, too: by packages_test.sh beside this file.
set -euo pipefail
tests=$(realpath "$(dirname "$0")")
source=$1
build=$2
version=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

command -v dh >/dev/null || { echo "debhelper is not installed"; exit 77; }
folder=usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)/gstreamer-1.0

package_of_build() {
  export DH_OPTIONS="-pgstreamer1.0-qdmd -pgstreamer1.0-qdmd-scene"
  mkdir -p "debian/tmp/$folder"
  cp "$build"/gst/*.so "debian/tmp/$folder"
  mkdir -p debian/tmp/usr/share/metainfo
  cp "$source"/gst/*.metainfo.xml debian/tmp/usr/share/metainfo
  dh_install
  dh_installdocs
  dh_installchangelogs
  dh_compress
  dh_strip --no-automatic-dbgsym
  dh_shlibdeps
  dh_installdeb
  dh_gencontrol
  dh_md5sums
  dh_builddeb
}

if [ "${QDMD_TEST_PACKAGE:-0}" = 1 ]; then
  "$source/gst/make-package.sh" "$work"
else
  mkdir "$work/tree"
  cp -r "$source/gst/debian" "$work/tree"
  (cd "$work/tree" && package_of_build)
fi

plugin=$(echo "$work"/gstreamer1.0-qdmd_*.deb)
scene=$(echo "$work"/gstreamer1.0-qdmd-scene_*.deb)
for package in "$plugin" "$scene"; do
  dpkg-deb --info "$package"
  [ "$(dpkg-deb --field "$package" Version)" = "$version" ]
  dpkg-deb --field "$package" Depends | grep -q 'libgstreamer1.0-0 (>= 1.22'
  dpkg-deb -x "$package" "$work/root"
done
dpkg-deb --field "$plugin" Depends | grep -q libhwy
# OpenCV brings 15 libraries, its imgcodecs some 140.
[[ $(dpkg-deb --field "$plugin" Depends) != *opencv* ]]
dpkg-deb --field "$scene" Depends | grep -q libopencv-imgcodecs

diff <(find "$work/root" ! -type d -printf '%P\n' | sort) <(sort <<EOF
$folder/libgstqdmd.so
$folder/libgstqdmdscene.so
usr/share/metainfo/org.example.gst_qdmd.metainfo.xml
usr/share/doc/gstreamer1.0-qdmd/changelog.gz
usr/share/doc/gstreamer1.0-qdmd/copyright
usr/share/doc/gstreamer1.0-qdmd-scene/changelog.gz
usr/share/doc/gstreamer1.0-qdmd-scene/copyright
EOF
)
"$tests/try_plugin.sh" "$work/root/$folder"

# Where they are installed already, they stay.
if [ "${QDMD_TEST_PACKAGE:-0}" = 1 ] && [ "${QDMD_TEST_INSTALL:-0}" = 1 ] && [ "$(id -u)" -eq 0 ] &&
  ! dpkg-query -W gstreamer1.0-qdmd 2>/dev/null; then
  "$tests/packages_test.sh" "$work"
fi
