#!/usr/bin/env bash
# Puts what qdmd-archive takes in time, memory and bytes into docs/archive.md anew, and the model that
# follows from it. Takes some fifteen minutes of a machine that does nothing else, and 5 GB of memory.
#
#   tests/pages/archive.sh [PAGE [memory]]    PAGE: another copy of docs/archive.md; memory: its table only
#   QDMD_ARCHIVE_FRAMES=200 QDMD_ARCHIVE_TURNS=1   less of both
set -euo pipefail
source "$(dirname "$0")/common.sh"
find_sequences
tests/install-dependencies.sh build test demo
build gst/libgstqdmd.so gst/libgstqdmdscene.so examples/archive/qdmd-archive
uptime >"$results/load-before"
/usr/bin/python3 tests/pages/archive_page.py "${1:-docs/archive.md}" "$(street_video)" "$results" "${@:2}"
