#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs tests with the compiler's sanitizers, in folders of their own.
#
#   tests/sanitize.sh                     the short form, a minute with its compiling: kernels with
#                                         address and undefined, threads with thread
#   tests/sanitize.sh --long [KIND...]    the tests in which threads meet, those of the kernels, and
#                                         of the element: many minutes of compiling for each
#                                         KIND: thread, address,undefined (default: both)
#   tests/sanitize.sh --suite [KIND...]   the tests of core/ and gst/, leaks too: an hour or more for
#                                         each KIND
set -euo pipefail
cd "$(dirname "$0")/.."

export TSAN_OPTIONS="halt_on_error=1 suppressions=$PWD/tests/gst/tsan.supp ${TSAN_OPTIONS:-}"
# What a test of leaks finds in libraries is not ours.
export ASAN_OPTIONS="detect_leaks=0 ${ASAN_OPTIONS:-}"
export UBSAN_OPTIONS="print_stacktrace=1 halt_on_error=1 ${UBSAN_OPTIONS:-}"
# An object that was freed is the allocator's memory again, not that of GLib's slices.
export G_SLICE=always-malloc

# The few files that the tests below need: all of the core takes minutes, because of Eigen.
short() {
  local kind=$1 name=$2 folder=build-sanitize/$2 file
  shift 2
  mkdir -p "$folder"
  rm -f "$folder"/*.o
  echo "== $name: $kind"
  for file in "$@"; do
    echo "$file" "$folder/${file//\//_}.o"
  done | xargs -P "$(nproc)" -L 1 bash -c \
    '${CXX:-c++} $0 -c "$1" -o "$2"' "$flags -fsanitize=$kind -fno-sanitize-recover=all"
  # shellcheck disable=SC2046,SC2086
  ${CXX:-c++} -fsanitize="$kind" "$folder"/*.o -o "$folder/$name" \
    $(pkg-config --libs gtest_main libhwy) -pthread
  # One part for each core.
  seq 0 $(($(nproc) - 1)) | GTEST_TOTAL_SHARDS=$(nproc) xargs -P "$(nproc)" -I{} \
    env GTEST_SHARD_INDEX={} "$folder/$name" --gtest_brief=1 --gtest_filter="-$slow"
}

# A comma in a folder's name would be one between the linker's options.
long() {
  local kind=$1 build=build-${1//,/-} again=() targets=() names=()
  [ ! -f "$build/build.ninja" ] || again=(--reconfigure)
  meson setup "${again[@]}" "$build" -Db_sanitize="$kind" -Db_lundef=false -Doptimization=1 \
    -Dtests=enabled -Dscene=disabled -Dwerror=false
  case "$kind" in
    thread) names=(pool side_thread workers decision band gram_slices live live_schedule absorb waiting_frames another_scene) ;;
    *) names=(engine kernel passes grid chroma digits picture combine gram gram_slices robust_fill median_picture light_of robust_parts pool side_thread workers resample) ;;
  esac
  for name in "${names[@]}"; do targets+=("tests/core/${name}_test"); done
  for name in features live separate faults; do targets+=("tests/gst/element-$name-test"); done
  ninja -C "$build" gst/libgstqdmd.so "${targets[@]}"
  export GST_PLUGIN_PATH_1_0="$PWD/$build/gst" GST_REGISTRY_1_0="$PWD/$build/registry.bin"
  # No other plugins: some do odd things when they are looked at.
  export GST_REGISTRY_FORK=no GST_PLUGIN_SYSTEM_PATH_1_0=
  for target in "${targets[@]}"; do
    echo "== $target: $kind"
    case "$target" in
      # The rest of them needs plugins, or takes long.
      *element*) set -- --gtest_filter='PropertyStorm*:Threads*:*OtherThreads*:Freeze*:Reset*:Pads.ComeAndGo*:Flow*:Queries*:Elements*:Clocks*' ;;
      # Others of them have one thread.
      *decision*) set -- --gtest_filter='Decision.*' ;;
      *) set -- ;;
    esac
    "$build/$target" --gtest_brief=1 "$@"
  done
}

# Tests of core/ and gst/ as meson runs them. What measures memory or time is left out: here they are
# the sanitizer's.
suite() {
  local kind=$1 build=build-${1//,/-} again=() tests=() programs=()
  [ ! -f "$build/build.ninja" ] || again=(--reconfigure)
  meson setup "${again[@]}" "$build" -Db_sanitize="$kind" -Db_lundef=false -Doptimization=1 \
    -Dtests=enabled -Dscene=enabled -Dwerror=false
  mapfile -t tests < <(meson introspect "$build" --tests | /usr/bin/python3 -c '
import json, re, sys
left_out = re.compile(r"valgrind|(?<!out_of_)memory$|allocation$|codecs|pacing|time_budget|literal")
for test in json.load(sys.stdin):
    part = test["suite"][0].partition(":")[2] or test["name"].partition("-")[0]
    if part in ("core", "fuzz", "element", "scene") and not left_out.search(test["name"]):
        print(test["name"])')
  mapfile -t programs < <(meson introspect "$build" --tests | /usr/bin/python3 -c '
import json, os, sys
for test in json.load(sys.stdin):
    if test["name"] in sys.argv[2:]:
        print(os.path.relpath(test["cmd"][0], sys.argv[1]))' "$build" "${tests[@]}")
  ninja -C "$build" -j "$(tests/jobs.sh)" gst/libgstqdmd.so gst/libgstqdmdscene.so "${programs[@]}"
  # A process that looks at plugins would be without the sanitizer.
  export GST_REGISTRY_FORK=no
  # What GLib and GStreamer keep to the end is theirs.
  export ASAN_OPTIONS="detect_leaks=1:allocator_may_return_null=1 ${ASAN_OPTIONS/detect_leaks=0/}"
  export LSAN_OPTIONS="suppressions=$PWD/tests/fuzz/lsan.supp:print_suppressions=0"
  meson test -C "$build" --no-rebuild --print-errorlogs --timeout-multiplier 20 "${tests[@]}"
}

tests/install-dependencies.sh build test
if [ "${1:-}" = --suite ]; then
  shift
  [ "$#" -gt 0 ] || set -- thread address,undefined
  for kind in "$@"; do suite "$kind"; done
  exit
elif [ "${1:-}" = --long ]; then
  shift
  [ "$#" -gt 0 ] || set -- thread address,undefined
  for kind in "$@"; do long "$kind"; done
  exit
elif [ "$#" -gt 0 ]; then
  sed -n '3,/^set/s/^# \?//p' "$0" >&2
  exit 2
fi

# Half of the time, for no other kernel.
slow=Kernels.RowsThatAreTheLastColumns:Kernels.BlackAndWhiteOfAllSizes
flags="-std=c++20 -O1 -g1 -I. $(pkg-config --cflags eigen3 libhwy | sed 's/-I/-isystem /g')"
short thread threads core/parallel/{pool,side_thread,workers}.cpp tests/core/{pool,side_thread,workers}_test.cpp
short address,undefined kernels core/gram/{tile_kernel,kernel,gram,block_sums,shared_chroma}.cpp core/planes/plane_slots.cpp \
  core/base/{large_vector,page_file}.cpp core/passes/{agreement,chroma,combine,digits,fill,median_rows,planes,read_samples,residual,window_mask}.cpp core/parallel/pool.cpp \
  tests/core/{gram,kernel,passes,chroma,digits,combine,shared_chroma}_test.cpp
