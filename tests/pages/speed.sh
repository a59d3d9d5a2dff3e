#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the table of whole pipelines into docs/performance.md anew: the element beside `segmentation`, and video as
# decoders give it beside a conversion in front; and how even the frames of mode=live are. Takes some eight minutes and
# 4 GB below build/.
set -euo pipefail
source "$(dirname "$0")/common.sh"
find_sequences
tests/install-dependencies.sh build test demo
build gst/libgstqdmd.so gst/libgstqdmdscene.so tests/bench/live
/usr/bin/python3 tests/pages/speed_page.py docs/performance.md "$(street_video)" "$results" "$PWD/build/tests/bench/live"
