#!/usr/bin/env bash
# Makes the pictures of the documentation from real runs: docs/images/street.jpg is the demo's
# contact sheet.
set -euo pipefail
cd "$(dirname "$0")/.."
examples/demo.sh
gst-launch-1.0 -q filesrc location=build/demo/contact-sheet.png ! pngdec ! videoconvert ! \
  videoscale method=lanczos ! video/x-raw,width=984,pixel-aspect-ratio=1/1 ! \
  jpegenc quality=82 ! filesink location=docs/images/street.jpg
ls -l docs/images
