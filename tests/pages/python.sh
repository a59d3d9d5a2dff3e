#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs docs/notebook/python.md: what it prints, and its pictures. Half a minute.
set -euo pipefail
source "$(dirname "$0")/common.sh"
tests/install-dependencies.sh build test python opencv docs
# Without a configured folder everything is built.
mapfile -t module < <([ ! -f build/build.ninja ] || ninja -C build -t targets all |
  sed -nE 's,^(python/qdmd/[^/:]+\.(so|py|pyi|typed)):.*,\1,p')
build "${module[@]}"
find_sequences
video=$(street_video)
[ -n "$video" ] || { echo "Run examples/demo.sh first: it fetches the video." >&2; exit 1; }
ln -sf "$(realpath "$video")" "$results/street.avi"
source=$PWD
cd "$results"
PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$source/build/python MPLBACKEND=Agg /usr/bin/python3 \
  "$source/tests/pages/python_page.py" "$source/docs/notebook/python.md" "$source/docs/images/python"
