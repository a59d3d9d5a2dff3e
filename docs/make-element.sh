#!/usr/bin/env bash
# Makes the reference of docs/element.md anew, from what the elements say of themselves.
set -euo pipefail
cd "$(dirname "$0")/.."

tests/install-dependencies.sh build test
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
meson setup "${again[@]}" build -Dtests=enabled -Dscene=enabled >/dev/null
ninja -C build gst/libgstqdmd.so gst/libgstqdmdscene.so

export GST_PLUGIN_PATH_1_0="$PWD/build/gst" GST_REGISTRY_1_0="$PWD/build/docs-registry.bin"
reference=$(mktemp)
trap 'rm -f "$reference"' EXIT
/usr/bin/python3 docs/element_page.py >"$reference"

/usr/bin/python3 - docs/element.md "$reference" <<'PYTHON'
import re
import sys

page, reference = sys.argv[1:]
start, end = '<!-- reference -->', '<!-- end of reference -->'
text, count = re.subn(f'{start}.*{end}',
                      lambda _: f'{start}\n{open(reference).read().strip()}\n{end}',
                      open(page).read(), flags=re.S)
if count != 1:
    sys.exit(f'{page} has no place for the reference')
open(page, 'w').write(text)
PYTHON
