#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs clang-tidy, with the checks of .clang-tidy, over sources as the build folder compiles them.
#
#   tests/tidy.sh                 all of core/ and gst/: most of an hour, because of Eigen
#   tests/tidy.sh PATH...         files, and folders with all below
set -euo pipefail
cd "$(dirname "$0")/.."
[ "$#" -gt 0 ] || set -- core gst
tests/install-dependencies.sh build test tidy
[ -f build/build.ninja ] || meson setup build -Dtests=enabled -Dscene=enabled
# GCC's own options are not clang's.
mapfile -t files < <(find "$@" -name '*.cpp' | sort)
printf '%s\n' "${files[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy -p build --quiet \
  --extra-arg=-Wno-unknown-warning-option
echo "${#files[@]} files, nothing found"
