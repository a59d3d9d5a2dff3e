# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts the hard cases, the estimators and the times of the small problem into docs/notebook/numerics.md.

Usage: numerics_page.py PAGE RESULTS
"""
import collections
import os
import re
import sys

from page import medians, put, read, table


def times(path):
    rows = collections.defaultdict(dict)
    for run in medians(path):
        name, size = re.match(r'([^/]+)/(?:m:)?(\d+)', run['run_name']).groups()
        unit = {'ns': 1e-6, 'us': 1e-3, 'ms': 1, 's': 1e3}[run['time_unit']]
        rows[name][int(size)] = run['real_time'] * unit
    sizes = sorted({size for row in rows.values() for size in row})
    return table(['ms', *(f'm = {size}' for size in sizes)],
                 [[name, *(f'{row[size]:.3g}' if size in row else '' for size in sizes)]
                  for name, row in rows.items()])


def main():
    page, folder = sys.argv[1:]
    put(page, {'cases': read(os.path.join(folder, 'cases.md')),
               'estimators': read(os.path.join(folder, 'estimators.md')),
              'times': times(os.path.join(folder, 'times.json'))})


main()
