#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Puts the table of docs/sampling.md anew. Needs the sequences: QDMD_DATA names the folder that has
# SBI, SBMnet and CDnet. Takes a few minutes.
set -euo pipefail
source "$(dirname "$0")/common.sh"
need_sequences

tests/install-dependencies.sh build test
build tests/evaluation/qdmd-sampling
build/tests/evaluation/qdmd-sampling --dataset "$QDMD_DATA" >"$results/table.md"
/usr/bin/python3 tests/pages/page.py docs/sampling.md sampling="$results/table.md"
