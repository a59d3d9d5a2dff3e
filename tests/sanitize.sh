#!/usr/bin/env bash
# Builds the element with a sanitizer, in a folder of its own, and runs the tests in which threads
# meet: many minutes of compiling.
#
#   tests/sanitize.sh [thread|address|undefined]     default: thread
set -euo pipefail
cd "$(dirname "$0")/.."
kind=${1:-thread}
build=build-$kind

tests/install-dependencies.sh build test
again=()
[ ! -f "$build/build.ninja" ] || again=(--reconfigure)
meson setup "${again[@]}" "$build" -Db_sanitize="$kind" -Db_lundef=false -Doptimization=1 \
  -Dtests=enabled -Dscene=disabled
targets=(gst/libgstqdmd.so)
for name in pool side_thread live freeze; do targets+=("tests/core/${name}_test"); done
for name in features live; do targets+=("tests/gst/element-$name-test"); done
ninja -C "$build" "${targets[@]}"

export TSAN_OPTIONS="halt_on_error=1 suppressions=$PWD/tests/gst/tsan.supp ${TSAN_OPTIONS:-}"
# What a test of leaks finds in libraries is not ours.
export ASAN_OPTIONS="detect_leaks=0 ${ASAN_OPTIONS:-}"
export GST_PLUGIN_PATH_1_0="$PWD/$build/gst" GST_REGISTRY_1_0="$PWD/$build/registry.bin"
export GST_REGISTRY_FORK=no
for target in "${targets[@]:1}"; do
  echo "== $target"
  "$build/$target" --gtest_brief=1
done
