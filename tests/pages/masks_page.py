"""Puts measured tables between the markers of docs/masks.md, and the scenes' sheets together.

Usage: masks_page.py PAGE RESULTS
"""
import json
import os
import sys

import matplotlib.image
import numpy

from page import put, table


def rows_of(path):
    """{row: {column: F}} of a Markdown table."""
    with open(path) as file:
        lines = [[cell.strip(' *') for cell in line.strip().strip('|').split('|')]
                 for line in file if line.startswith('|')]
    head, rows = lines[0][1:], lines[2:]
    return {row[0]: dict(zip(head, map(float, row[1:]))) for row in rows}


def scenes(path):
    measured = rows_of(path)
    names = [name for name in next(iter(measured.values())) if name != 'mean']
    columns = ['default', 'mode=live', 'OpenCV MOG2', 'OpenCV KNN']
    rows = []
    for name in names:
        values = [measured[column][name] for column in columns]
        below = 'below' if values[0] < max(values[2:]) - 0.01 else ''
        rows.append([name] + [f'{value:.3f}' for value in values] + [below])
    return table(['scene'] + columns + [''], rows)


def cost(path):
    with open(path) as file:
        runs = json.load(file)['benchmarks']
    medians = {run['run_name'].removesuffix('/manual_time'): run['ns/pixel'] for run in runs
               if run['aggregate_name'] == 'median'}
    titles = {'decide': 'all steps', 'decide_shadows_foreground': 'shadows=foreground'}
    sizes = list(dict.fromkeys(name.split('/')[1] for name in medians))
    return table(['ns a pixel'] + sizes,
                 [[title] + [f'{medians[f"{name}/{size}"]:.1f}' for size in sizes]
                  for name, title in titles.items()])


def main(page, results):
    with open(os.path.join(results, 'steps.md')) as file:
        steps = file.read()
    put(page, {'steps': steps, 'scenes': scenes(os.path.join(results, 'scenes.md')),
               'cost': cost(os.path.join(results, 'cost.json'))})
    sheets = [matplotlib.image.imread(os.path.join(results, f'sheet-{name}.png'))
              for name in ('basic-shadow', 'background-motion', 'basic-night')]
    matplotlib.image.imsave(os.path.join(results, 'scenes.png'), numpy.vstack(sheets))


if __name__ == '__main__':
    main(*sys.argv[1:])
