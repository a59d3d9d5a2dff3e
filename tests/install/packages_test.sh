#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Has lintian look at the Debian packages of FOLDER, installs them on this machine, uses what is in them and
# removes them again: packages_test.sh FOLDER, as root. It is meant for a root of tests/root.sh.
set -euo pipefail
folder=$(realpath "$1")
source=$(realpath "$(dirname "$0")/../..")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
export DEBIAN_FRONTEND=noninteractive GST_REGISTRY_1_0="$work/registry.bin"
unset GST_PLUGIN_PATH GST_PLUGIN_PATH_1_0 GST_PLUGIN_SYSTEM_PATH_1_0 PYTHONPATH
apt() { apt-get -qq -y -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=120 "$@" >apt.log 2>&1 || { tail -n 20 apt.log >&2; exit 1; }; }
names=(gstreamer1.0-qdmd gstreamer1.0-qdmd-scene libqdmd0 libqdmd-dev python3-qdmd qdmd-tools)
packages=()
for name in "${names[@]}"; do packages+=("$(echo "$folder/${name}"_*.deb)"); done
find / -xdev -name '*qdmd*' ! -path '/root/*' ! -path '/tmp/*' ! -path '/proc/*' | sort >before

if command -v lintian >/dev/null; then
  echo "== lintian"
  lintian --allow-root --fail-on warning,error "${packages[@]}"
fi

echo "== the ten lines of docs/python.md, with nothing but their package"
apt install "${packages[4]}"
apt install --no-install-recommends gstreamer1.0-tools gstreamer1.0-plugins-base gstreamer1.0-plugins-good \
  gstreamer1.0-plugins-ugly gstreamer1.0-libav g++ pkg-config libopencv-dev
apt install --no-install-recommends "${packages[@]:0:2}"
gst-launch-1.0 -q qdmdscenesrc scene=basic num-buffers=120 ! videoconvert ! jpegenc ! avimux ! filesink location=street.avi
awk '/^```python/ { inside = 1; next } /^```/ && inside { exit } inside' "$source/docs/python.md" >lines.py
/usr/bin/python3 lines.py
[ -s background.png ]

echo "== plugins"
gst-launch-1.0 -q qdmdscenesrc scene=basic num-buffers=120 ! qdmdbackground ! videoconvert ! pngenc ! \
  multifilesink location=empty.png
[ -s empty.png ]

echo "== the library, by docs/library.md"
apt install --no-install-recommends "${packages[@]:2:2}"
# shellcheck disable=SC2046
g++ -std=c++17 /usr/share/doc/libqdmd-dev/examples/subtract.cpp -o subtract $(pkg-config --cflags qdmd opencv4) \
  $(pkg-config --libs qdmd) -lopencv_core -lopencv_imgcodecs -lopencv_videoio -lopencv_video
./subtract street.avi subtracted.png mask.png
[ -s subtracted.png ] && [ -s mask.png ]

echo "== the tools"
apt install --no-install-recommends "${packages[5]}"
qdmd-scene-sequence sequences/basic basic 0 60
qdmd-evaluate --dataset sequences --methods robust,median
qdmd-archive street.avi --background archived.png --jobs 1
[ -s archived.png ]
for program in qdmd-archive qdmd-evaluate qdmd-scene-sequence; do
  gunzip -c "/usr/share/man/man1/$program.1.gz" | grep -q "$program"
done

echo "== removed"
apt purge "${names[@]}"
diff before <(find / -xdev -name '*qdmd*' ! -path '/root/*' ! -path '/tmp/*' ! -path '/proc/*' | sort)
echo "packages: $(dpkg-deb --field "${packages[0]}" Version), installed, used and removed"
