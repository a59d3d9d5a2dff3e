# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts measured tables between the markers of docs/masks.md and its notebook, and the scenes' sheets together.

Usage: masks_page.py PAGE NOTEBOOK RESULTS
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
    titles = {'decide/all': 'all steps', 'decide/without_noise': 'without noise of each pixel',
              'decide/without_texture': 'without moving textures',
              'decide/without_light': 'without light', 'decide/without_vote': 'without vote, specks and holes',
              'decide/without_specks': 'without specks and holes',
              'decide/alone': 'each pixel by itself', 'decide/half_ignored': 'all steps, half ignored',
              'decide/noisy': 'all steps in much noise',
              'decide/noisy_without_smooth': 'in much noise, without means',
              'soft/1': 'mask-softness=1 adds', 'soft/2': 'mask-softness=2 adds',
              'soft/4': 'mask-softness=4 adds', 'soft/8': 'mask-softness=8 adds',
              'soft/15': 'mask-softness=15 adds',
              'specks/ours/few': 'specks and holes alone',
              'specks/opencv/few': "the same with OpenCV's connectedComponentsWithStats",
              'regions/ours': 'boxes of regions alone',
              'regions/opencv': "their parts with OpenCV's dilate and connectedComponents"}
    sizes = list(dict.fromkeys(name.split('/')[-1] for name in medians))
    rows = []
    for name, title in titles.items():
        digits = 2 if '/ours' in name else 1
        rows.append([title] + [f'{medians[f"{name}/{size}"]:.{digits}f}' for size in sizes])
    return table(['ns a pixel'] + sizes, rows)


def soft(folder, path):
    """People of the street scene before one colour: cut out hard, and soft."""
    pictures = []
    for softness in (0, 2):
        cut = matplotlib.image.imread(os.path.join(folder, str(softness), '060.png'))[190:400, 420:740]
        alpha = cut[..., 3:4]
        plain = cut[..., :3] * alpha + numpy.array([0.2, 0.45, 0.3]) * (1 - alpha)
        pictures.append(numpy.kron(plain, numpy.ones((2, 2, 1))))
    matplotlib.image.imsave(path, numpy.hstack(pictures))


def main(page, notebook, results):
    with open(os.path.join(results, 'steps.md')) as file:
        steps = file.read()
    with open(os.path.join(results, 'constants.md')) as file:
        constants = file.read()
    put(page, {'scenes': scenes(os.path.join(results, 'scenes.md'))})
    put(notebook, {'steps': steps, 'constants': constants, 'cost': cost(os.path.join(results, 'cost.json'))})
    sheets = [matplotlib.image.imread(os.path.join(results, f'sheet-{name}.png'))
              for name in ('basic-shadow', 'background-motion', 'basic-night')]
    matplotlib.image.imsave(os.path.join(results, 'scenes.png'), numpy.vstack(sheets))
    if os.path.isdir(os.path.join(results, 'soft')):
        soft(os.path.join(results, 'soft'), os.path.join(results, 'soft.png'))


if __name__ == '__main__':
    main(*sys.argv[1:])
