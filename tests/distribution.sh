#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Tries the last commit on another version of Debian, in a root of its own (tests/root.sh), from the
# tarball that `meson dist` makes:
#
#   tests/distribution.sh SUITE [PART...]      SUITE: trixie (Debian 13), bookworm (12)
#
#   commands     README.md's: the demo, and scenes through the element
#   tests        builds with warnings as errors, and runs the tests of the suite `fast`
#   all-tests    the same with all tests; those of recorded sequences are skipped
#   packages     makes the Debian packages, has lintian look at them, installs, uses and removes them
#   arm64-packages   the same for 64-bit Arm: cross-built in the root SUITE-arm64, and used by QEMU in
#                    SUITE-on-arm64
#
# Without a part: commands and tests, half an hour on two cores at first, some minutes later.
set -euo pipefail
cd "$(dirname "$0")/.."
usage() { sed -n '3,/^set/{/^set/d;s/^# \?//p}' tests/distribution.sh; }
suite=${1-}
if [[ ! $suite =~ ^[a-z]+$ ]]; then
  usage >&2
  exit 2
fi
shift
[ "$#" -gt 0 ] || set -- commands tests
root=$suite
in_root() { tests/root.sh "$root" "$@"; }
# Within the tree there, at a low priority.
in_tree() { in_root nice -n 15 bash -c 'set -euo pipefail; cd /root/gst-qdmd; eval "$1"' bash "$1"; }
quiet='quiet() { "$@" >quiet.log 2>&1 || { tail -n 40 quiet.log; exit 1; }; }'

take_tree() {
  echo "== $root: the tarball of $(git log -1 --format=%h)"
  tests/root.sh --tree "$root"
  # Compilers need not do the same work twice.
  in_root bash -c 'command -v ccache || { apt-get -qq update; apt-get -qq install --no-install-recommends ccache; }' \
    >/dev/null 2>&1
}
build_for_tests() {
  in_tree "$quiet"'
    tests/install-dependencies.sh build test
    [ ! -f build/build.ninja ] || again=--reconfigure
    quiet meson setup ${again-} build -Dtests=enabled -Dscene=enabled'
}
[ "$*" = arm64-packages ] || take_tree
for part in "$@"; do
  root=$suite
  echo "== $suite: $part"
  case "$part" in
    commands)
      in_tree 'examples/demo.sh >demo.log 2>&1 || { tail -n 40 demo.log; exit 1; }; tail -n 5 demo.log
        GST_PLUGIN_PATH=$PWD/build/gst gst-launch-1.0 -q qdmdscenesrc scene=basic num-buffers=150 ! \
          qdmdbackground ! videoconvert ! pngenc ! multifilesink location=build/street.png
        [ -s build/street.png ]' ;;
    tests)
      build_for_tests
      in_tree 'tests/run.sh --fast' ;;
    all-tests)
      build_for_tests
      in_tree "$quiet"'
        quiet ninja -C build -j "$(tests/jobs.sh)"
        status=0
        meson test -C build --no-rebuild --print-errorlogs -t 4 || status=$?
        tests/count_results.py build
        exit "$status"' ;;
    packages)
      in_tree "$quiet"'
        tests/install-dependencies.sh lint
        quiet gst/make-package.sh
        tests/install/packages_test.sh build/package' ;;
    arm64-packages)
      root=$suite-arm64
      take_tree
      in_tree "$quiet"'
        quiet gst/make-package.sh --arch arm64'
      made=$(tests/root.sh --path "$root")/root/gst-qdmd/build/package
      root=$suite-on-arm64
      take_tree
      cp -r "$made" "$(tests/root.sh --path "$root")/root/gst-qdmd/arm64"
      in_tree 'tests/install-dependencies.sh lint
        tests/install/packages_test.sh arm64' ;;
    *)
      usage >&2
      exit 2 ;;
  esac
done
in_root bash -c '. /etc/os-release; printf "%s: %s, %s, " "$(date +%F)" "$PRETTY_NAME" "$(dpkg --print-architecture)"
  printf "g++ %s, GStreamer %s, OpenCV %s, Highway %s, Python %s\n" "$(g++ -dumpfullversion)" \
    "$(dpkg-query -f "\${source:Upstream-Version}" -W libgstreamer1.0-0)" "$(pkg-config --modversion opencv4)" \
    "$(pkg-config --modversion libhwy 2>/dev/null || echo of the packages)" "$(python3 -c "import platform; print(platform.python_version())")"'
