#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts what qdmd-archive takes in time into docs/archive.md anew, how far masks of parts are those of
# one piece, and the model that follows. Takes some forty minutes of a machine that does nothing else.
#
#   tests/pages/archive.sh [PAGE]    PAGE: another copy of docs/archive.md
#   QDMD_ARCHIVE_TIMES=2 QDMD_ARCHIVE_TURNS=1   a shorter film, and less of it
set -euo pipefail
source "$(dirname "$0")/common.sh"
find_sequences
tests/install-dependencies.sh build test demo
build gst/libgstqdmd.so gst/libgstqdmdscene.so examples/archive/qdmd-archive
uptime >"$results/load-before"
/usr/bin/python3 tests/pages/archive_page.py "${1:-docs/archive.md}" "$(street_video)" "$results"
