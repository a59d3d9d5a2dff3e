#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""From an lcov record on standard input: of each file the lines that no test ran, as ranges."""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def ranges(numbers):
    """'3-5, 9' of [3, 4, 5, 9]."""
    pieces = []
    for number in sorted(numbers):
        if pieces and number == pieces[-1][1] + 1:
            pieces[-1][1] = number
        else:
            pieces.append([number, number])
    return ', '.join(f'{a}' if a == b else f'{a}-{b}' for a, b in pieces)


name, left = '', []
for line in sys.stdin:
    key, _, value = line.strip().partition(':')
    if key == 'SF':
        path = pathlib.Path(value).resolve()
        name, left = str(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path), []
    elif key == 'DA' and value.split(',')[1] == '0':
        left.append(int(value.split(',')[0]))
    elif key == 'end_of_record' and left:
        print(f'{name}: {ranges(left)}')
