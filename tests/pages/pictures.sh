#!/usr/bin/env bash
# Makes README.md's picture of a street from a real run: docs/images/street.jpg is the demo's contact
# sheet.
set -euo pipefail
source "$(dirname "$0")/common.sh"
examples/demo.sh
shrink build/demo/contact-sheet.png 984 docs/images/street.jpg
ls -l docs/images/street.jpg
