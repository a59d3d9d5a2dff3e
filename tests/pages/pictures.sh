#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Makes README.md's animated picture of a street from a real run of the element: docs/images/street.webp.
set -euo pipefail
source "$(dirname "$0")/common.sh"
tests/install-dependencies.sh build demo docs
build gst/libgstqdmd.so
find_sequences
video=$(street_video)
[ -n "$video" ] || { echo "Run examples/demo.sh first: it fetches the video." >&2; exit 1; }
/usr/bin/python3 tests/pages/animation.py "$video" "$results" docs/images/street.webp
rm "$results"/*.raw
ls -l docs/images/street.webp
