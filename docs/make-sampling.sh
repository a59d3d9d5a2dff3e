#!/usr/bin/env bash
# Puts the table of docs/sampling.md anew. Needs the sequences: QDMD_DATA names the folder that has
# SBI, SBMnet and CDnet. Takes a few minutes.
set -euo pipefail
cd "$(dirname "$0")/.."

if [ -z "${QDMD_DATA:-}" ] && [ -d ../shared/data ]; then QDMD_DATA=$(cd ../shared/data && pwd); fi
[ -d "${QDMD_DATA:-}/SBI" ] ||
  { echo "Set QDMD_DATA to the folder that has SBI, SBMnet and CDnet." >&2; exit 1; }

tests/install-dependencies.sh build test
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
meson setup "${again[@]}" build -Dtests=enabled >/dev/null
ninja -C build tests/evaluation/qdmd-sampling
table=$(build/tests/evaluation/qdmd-sampling --dataset "$QDMD_DATA")

/usr/bin/python3 - docs/sampling.md "$table" <<'PYTHON'
import re
import sys

page, table = sys.argv[1:]
start, end = '<!-- sampling -->', '<!-- end of sampling -->'
text, count = re.subn(start + '.*?' + end, lambda _: f'{start}\n{table.strip()}\n{end}',
                      open(page).read(), flags=re.S)
if count != 1:
    sys.exit(f'{page} has no place for the table')
open(page, 'w').write(text)
PYTHON
