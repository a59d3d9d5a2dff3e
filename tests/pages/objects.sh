#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Makes the tables and the picture of docs/objects.md. Takes ten minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"
tests/install-dependencies.sh build test demo docs
build gst/libgstqdmd.so tests/evaluation/qdmd-objects
# Constants were chosen on seeds 0 to 2 and 100 to 119.
for mode in live batch truth; do
  case "$mode" in
    live) flag="" ;;
    batch) flag=--batch ;;
    truth) flag=--true-masks ;;
  esac
  build/tests/evaluation/qdmd-objects $flag --first-seed 300 --seeds 20 >"$results/$mode.txt"
  awk '/^\| scene \| event/ { print; getline; print } /^\| \*\*/' "$results/$mode.txt" >"$results/$mode-events.md"
  awk '/^\| scene \| MOTA/ { on = 1 } /^$/ { on = 0 } on' "$results/$mode.txt" >"$results/$mode-tracking.md"
done
awk '/^\| scene \| mask/ { on = 1 } on' "$results/live.txt" >"$results/cost.md"
/usr/bin/python3 tests/pages/page.py docs/objects.md live="$results/live-events.md" \
  batch="$results/batch-events.md" truth="$results/truth-events.md" tracking="$results/live-tracking.md" cost="$results/cost.md"
find_sequences
video=$(street_video)
[ -z "$video" ] ||
  /usr/bin/python3 tests/pages/objects_picture.py "$video" 300 192 docs/images/objects/street.jpg
