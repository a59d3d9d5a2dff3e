#!/usr/bin/env bash
# Puts the tables of docs/numerics.md anew: the hard cases against 50 digits, and the times of the
# small problem. Takes some minutes.
set -euo pipefail
cd "$(dirname "$0")/.."

tests/install-dependencies.sh build test
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
meson setup "${again[@]}" build -Dtests=enabled >/dev/null
ninja -C build tests/stability/stability-table tests/bench/solve

cases=$(mktemp)
times=$(mktemp)
trap 'rm -f "$cases" "$times"' EXIT
build/tests/stability/stability-table >"$cases"
build/tests/bench/solve --benchmark_repetitions=5 --benchmark_report_aggregates_only=true \
  --benchmark_format=json >"$times"

/usr/bin/python3 - docs/numerics.md "$cases" "$times" <<'PYTHON'
import collections
import json
import re
import sys

page, cases, times = sys.argv[1:]
text = open(page).read()


def put(name, table):
    global text
    start, end = f'<!-- {name} -->', f'<!-- end of {name} -->'
    text, count = re.subn(re.escape(start) + '.*?' + re.escape(end),
                          lambda _: f'{start}\n{table.strip()}\n{end}', text, flags=re.S)
    if count != 1:
        sys.exit(f'{page} has no place for {name}')


put('cases', open(cases).read())

rows = collections.defaultdict(dict)
for run in json.load(open(times))['benchmarks']:
    if run.get('aggregate_name') != 'median':
        continue
    name, size = re.match(r'([^/]+)/(?:m:)?(\d+)', run['run_name']).groups()
    unit = {'ns': 1e-6, 'us': 1e-3, 'ms': 1, 's': 1e3}[run['time_unit']]
    rows[name][int(size)] = run['real_time'] * unit
sizes = sorted({size for row in rows.values() for size in row})
lines = ['| ms | ' + ' | '.join(f'm = {size}' for size in sizes) + ' |',
         '|---|' + '---|' * len(sizes)]
for name, row in rows.items():
    cells = (f'{row[size]:.3g}' if size in row else '' for size in sizes)
    lines.append(f'| {name} | ' + ' | '.join(cells) + ' |')
put('times', '\n'.join(lines))
open(page, 'w').write(text)
PYTHON
