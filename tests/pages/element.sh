#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Makes the reference of docs/element.md anew, from what the elements say of themselves.
set -euo pipefail
source "$(dirname "$0")/common.sh"

tests/install-dependencies.sh build test
build gst/libgstqdmd.so gst/libgstqdmdscene.so
/usr/bin/python3 tests/pages/element_page.py >"$results/reference.md"
/usr/bin/python3 tests/pages/page.py docs/element.md reference="$results/reference.md"
