#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the table and the plot of docs/robust.md anew that say what a stream's backgrounds are worth. Needs
# the sequences: QDMD_DATA names the folder that has SBI, SBMnet and CDnet. Takes some four minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"
need_sequences

tests/install-dependencies.sh build test docs opencv
build gst/libgstqdmd.so
/usr/bin/python3 tests/pages/stream_page.py docs/robust.md docs/images/robust-stream.svg
