# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts what was measured of robust Q-DMD into docs/notebook/robust.md.

Usage: robust_page.py PAGE RESULTS
"""
import json
import os
import sys

from page import put, read, table


def short(sequence):
    return sequence.split('/')[-1]


def ages(rows, method):
    return {row['sequence']: row['AGE'] for row in rows if row['method'] == method}


def line(name, values):
    values = list(values)
    return [name, *(f'{value:.2f}' for value in values), f'**{sum(values) / len(values):.2f}**']


def masks(rows):
    lines = [[short(row['sequence']), row['method'],
              *(f'{row[measure]:.3f}' for measure in ('precision', 'recall', 'F'))]
             for row in rows
             if row['F'] is not None and row['method'] in ('robust', 'qdmd', 'mog2', 'knn')]
    return table(['sequence', 'method', 'precision', 'recall', 'F'], lines)


def main():
    page, folder = sys.argv[1:]

    def load(name):
        return json.loads(read(os.path.join(folder, name + '.json')))

    def robust(rows):
        return ages(rows, 'robust').values()

    whole = load('whole')
    methods = list(dict.fromkeys(row['method'] for row in whole))
    head = ['AGE', *(short(sequence) for sequence in ages(whole, methods[0])), '**mean**']
    put(page, {
        'methods': table(head, [line(method, ages(whole, method).values()) for method in methods]),
        'orders': table(head, [line('robust', robust(whole)),
                               line('robust, reversed', robust(load('reversed'))),
                               line('robust, every second frame', robust(load('every-second')))]),
        'masks': masks(whole),
        'ablation': read(os.path.join(folder, 'ablation.md')),
        'constants': read(os.path.join(folder, 'constants.md')),
    })


main()
