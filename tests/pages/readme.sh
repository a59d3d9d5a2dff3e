#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts README.md's table of figures anew, from the tables that other scripts here put into docs/robust.md (stream.sh),
# docs/notebook/masks.md (masks.sh) and docs/performance.md (speed.sh). A test says where it is not what they say.
set -euo pipefail
source "$(dirname "$0")/common.sh"
/usr/bin/python3 tests/pages/readme_page.py docs >"$results/figures.md"
/usr/bin/python3 tests/pages/page.py README.md figures="$results/figures.md"
