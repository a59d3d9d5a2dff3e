# SPDX-License-Identifier: LGPL-2.1-or-later
"""Prints README.md's table of figures from the tables of other pages, each of which a script made.

usage: readme_page.py DOCS
"""
import sys

import page


def rows(name, marker):
    """{first cell: the other cells} of the table between a page's markers."""
    lines = [[cell.strip(' *') for cell in line.strip().strip('|').split('|')]
             for line in page.block(f'{sys.argv[1]}/{name}', marker).splitlines() if line.startswith('|')]
    return {line[0]: line[1:] for line in lines}


stream = rows('robust.md', 'stream')
steps = rows('notebook/masks.md', 'steps')
speed = rows('performance.md', 'speed')


def error(name):
    return stream[name][-1].split(' / ')[0]


def mask(name):
    return steps[name][-1]


def times(name):
    middle = speed[name][speed['ms a frame (times as fast as `segmentation`)'].index('768x576')]
    return middle[middle.index('(') + 1:-1]


print(page.table(
    ['', 'error of the background', 'F of the mask', 'speed (1 is `segmentation`)'],
    [['**default**', error('default'), mask('default'), times('default, `output=mask`')],
     ['**`mode=live`**', error('mode=live'), mask('mode=live'), times('`mode=live output=mask`')],
     ['MOG2', error('MOG2'), mask('OpenCV MOG2'), '1'],
     ['KNN', error('KNN'), mask('OpenCV KNN'), ''],
     ['median of all frames so far', error('median so far'), '', '']]))
