#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the spectra of docs/algorithm.md and its notebook: forty frames of a street, at full rank, where one mode is the
# background, and 150 of Board (SBI), where several share it. A minute.
set -euo pipefail
source "$(dirname "$0")/common.sh"
need_sequences
tests/install-dependencies.sh build demo docs
build gst/libgstqdmd.so
video=$(street_video)
[ -n "$video" ] || { echo "Run examples/demo.sh first: it fetches the video." >&2; exit 1; }
draw() { /usr/bin/python3 tests/evaluation/spectrum.py "$@"; }
draw docs/images/spectrum-street.svg "filesrc location=$video ! decodebin" -- window-size=40 rank=0
pictures=$QDMD_DATA/SBI/Board/input
draw docs/images/spectrum-split.svg \
  "multifilesrc location=$pictures/in%06d.png caps=image/png,framerate=25/1 ! decodebin" -- \
  window-size=150 rank=0
