#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Cross-builds the last commit for 64-bit Arm, whose vectors are NEON, in a root of Debian 13
# (tests/root.sh), and runs tests of the core and of the elements under QEMU: once as a processor without
# dot-product instructions (Cortex-A53), once as one that has all that QEMU knows (max).
#
#   tests/neon.sh [TEST...]      by meson's names; without, those of `tests` below: an hour
set -euo pipefail
cd "$(dirname "$0")/.."
root=trixie-arm64
in_root() { tests/root.sh "$root" "$@"; }
in_tree() { in_root nice -n 15 bash -c 'set -euo pipefail; cd /root/gst-qdmd; eval "$1"' bash "$1"; }
tests=(kernel gram passes chroma digits combine mask_passes soft_mask resample robust_fill median_picture pool engine
  live golden element-negotiation element-stream element-live element-masks element-messages element-features
  element-separate element-save element-analytics library)
[ "$#" -eq 0 ] || tests=("$@")

tests/root.sh --tree "$root"
in_root bash -c 'set -euo pipefail
  dpkg --add-architecture arm64
  arm=()
  for name in libgstreamer1.0-dev libgstreamer-plugins-base1.0-dev libgstreamer-plugins-bad1.0-dev libhwy-dev \
    libopencv-dev libgtest-dev libbenchmark-dev gstreamer1.0-plugins-base gstreamer1.0-plugins-bad; do
    arm+=("$name:arm64")
  done

  wanted=(ccache meson ninja-build pkg-config g++ g++-aarch64-linux-gnu qemu-user python3-numpy libeigen3-dev
    libboost-dev libcli11-dev nlohmann-json3-dev "${arm[@]}")
  dpkg-query -W -f "\${Status}\n" "${wanted[@]}" 2>/dev/null | grep -c "ok installed" >count || true
  [ "$(cat count)" -ne "${#wanted[@]}" ] || exit 0
  apt-get -qq update
  apt-get -qq install --no-install-recommends "${wanted[@]}"' >build/neon.log 2>&1 ||
  { tail -n 20 build/neon.log >&2; exit 1; }

in_tree 'cat >arm.ini <<INI
[binaries]
cpp = ["ccache", "aarch64-linux-gnu-g++"]
ar = "aarch64-linux-gnu-ar"
strip = "aarch64-linux-gnu-strip"
pkg-config = "pkg-config"
exe_wrapper = "qemu-aarch64"
[properties]
pkg_config_libdir = ["/usr/lib/aarch64-linux-gnu/pkgconfig", "/usr/share/pkgconfig"]
[host_machine]
system = "linux"
cpu_family = "aarch64"
cpu = "aarch64"
endian = "little"
INI
sed -i "s/\"/\x27/g" arm.ini
meson setup --cross-file arm.ini build -Dtests=enabled -Dscene=enabled -Dexamples=disabled -Dpython=disabled >setup.log 2>&1 ||
  { tail -n 20 setup.log; exit 1; }'
targets() {
  in_tree 'meson introspect build --tests | python3 -c "
import json, os, sys
names = sys.argv[1:]
tests = [t for t in json.load(sys.stdin) if t[\"name\"] in names]
print(*sorted({os.path.relpath(w, os.path.abspath(\"build\")) for t in tests for w in t[\"cmd\"] if \"/build/\" in w}))" '"$*"
}
echo "== compiling for arm64"
in_tree "ninja -C build -j \"\$(tests/jobs.sh)\" gst/libgstqdmd.so gst/libgstqdmdscene.so $(targets "${tests[@]}") >make.log 2>&1 ||
  { grep -A20 FAILED make.log | head -n 40; exit 1; }"
for cpu in cortex-a53 max; do
  echo "== QEMU as $cpu"
  in_tree "export QEMU_CPU=$cpu GST_REGISTRY_FORK=no
    status=0
    meson test -C build --no-rebuild --print-errorlogs -t 20 ${tests[*]} || status=\$?
    tests/count_results.py build; exit \"\$status\""
done
