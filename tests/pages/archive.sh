#!/usr/bin/env bash
# Puts what qdmd-archive takes in time, memory and bytes into docs/archive.md anew, and the model that
# follows from it. Takes some ten minutes, 3 GB of memory and 1 GB below build/.
#
#   tests/pages/archive.sh [PAGE]      PAGE: another copy of docs/archive.md
set -euo pipefail
source "$(dirname "$0")/common.sh"
find_sequences
tests/install-dependencies.sh build test demo
build gst/libgstqdmd.so gst/libgstqdmdscene.so examples/archive/qdmd-archive
uptime >"$results/load-before"
/usr/bin/python3 tests/pages/archive_page.py "${1:-docs/archive.md}" "$(street_video)" "$results"
