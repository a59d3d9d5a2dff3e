#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Installs the Debian packages that are missing, as root or through sudo. Asks no network and prints
# nothing when all are there.
#
#   tests/install-dependencies.sh GROUP...      groups: build, test, package, demo, docs, opencv,
#                                               fuzz, tidy, coverage, python, root, lint
set -euo pipefail

build=(g++ meson ninja-build pkg-config libgstreamer1.0-dev libgstreamer-plugins-base1.0-dev
  libeigen3-dev libhwy-dev libopencv-dev)
# plugins-bad has gstreamer-check's fakevideosink, -base the sources and converters, -ugly and -x what
# the documentation's pipelines and the demo encode and write text with, -opencv the element that
# tests/bench compares with, -libav the lossless encoder of qdmd-archive and what plays H.264 and
# H.265 of 10 bits, openmpi what starts qdmd-archive; gi runs the examples in Python. Headers of plugins-bad
# have analytics metadata from GStreamer 1.24 on.
test=(python3 python3-numpy python3-gi gir1.2-gstreamer-1.0 gir1.2-gst-plugins-base-1.0 valgrind
  clang-format libgtest-dev libbenchmark-dev libboost-dev libcli11-dev nlohmann-json3-dev
  gstreamer1.0-tools gstreamer1.0-plugins-base gstreamer1.0-plugins-good gstreamer1.0-plugins-bad
  gstreamer1.0-plugins-ugly gstreamer1.0-libav gstreamer1.0-x gstreamer1.0-opencv openmpi-bin
  libopenmpi-dev pybind11-dev python3-dev python3-pytest appstream libgstreamer-plugins-bad1.0-dev)
# The module qdmd for Python.
python=(pybind11-dev python3-dev python3-numpy)
# What gst/debian/control asks for beyond build; tests make a package, too.
package=(build-essential debhelper dpkg-dev dh-python help2man libopencv-dev libcli11-dev nlohmann-json3-dev libopenmpi-dev
  pybind11-dev python3-dev python3-numpy libgstreamer-plugins-bad1.0-dev)
# -libav decodes the street scene, -ugly encodes H.264, -x writes text.
demo=(gstreamer1.0-tools gstreamer1.0-plugins-base gstreamer1.0-plugins-good
  gstreamer1.0-plugins-ugly gstreamer1.0-libav gstreamer1.0-x)
# Plots of docs/performance.md.
docs=(python3 python3-matplotlib)
# What tests/pages/stream.sh compares with.
opencv=(python3-numpy python3-opencv)
fuzz=(clang)
tidy=(clang-tidy)
coverage=(clang llvm)
# What makes the roots of tests/root.sh, and those for another processor, and what looks at packages.
root=(mmdebstrap debian-archive-keyring)
foreign=(qemu-user-static arch-test dpkg-dev)
lint=(lintian)

wanted=()
for group in "$@"; do
  case "$group" in
    build) wanted+=("${build[@]}") ;;
    test) wanted+=("${test[@]}") ;;
    package) wanted+=("${package[@]}") ;;
    demo) wanted+=("${demo[@]}") ;;
    docs) wanted+=("${docs[@]}") ;;
    opencv) wanted+=("${opencv[@]}") ;;
    fuzz) wanted+=("${fuzz[@]}") ;;
    tidy) wanted+=("${tidy[@]}") ;;
    coverage) wanted+=("${coverage[@]}") ;;
    python) wanted+=("${python[@]}") ;;
    root) wanted+=("${root[@]}") ;;
    foreign) wanted+=("${foreign[@]}") ;;
    lint) wanted+=("${lint[@]}") ;;
    *) echo "unknown group of packages: $group (build, test, package, demo, docs, opencv, fuzz, tidy, coverage, python, root, foreign, lint)" >&2; exit 2 ;;
  esac
done

missing=()
for package in "${wanted[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' ||
    missing+=("$package")
done
[ "${#missing[@]}" -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null ||
    { echo "Missing packages: ${missing[*]}. Install them, or run this as root." >&2; exit 1; }
  as_root=(sudo)
fi
echo "Installing ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! { "${as_root[@]}" apt-get update -q &&
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -q -y --no-install-recommends "${missing[@]}"; } </dev/null >"$log" 2>&1; then
  tail -n 20 "$log" >&2
  echo "Installing packages failed; the lines above are apt-get's last." >&2
  exit 1
fi
