# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts the reference of scenes into docs/scenes.md, and their times into its notebook.

Usage: scenes_page.py PAGE NOTEBOOK RESULTS
"""
import os
import re
import sys

from page import medians, put, read, table


def times(path, names):
    by_scene, ratios = {}, {}
    for run in medians(path):
        name, width, height = re.match(r'([^/]+)/width:(\d+)/height:(\d+)',
                                       run['run_name']).groups()
        size = f'{width}x{height}'
        by_scene.setdefault(name, {})[size] = run['real_time']
        if 'ratio' in run:
            ratios[size] = run['ratio']
    by_scene.pop('default_against_bare_loop')
    # The benchmark runs them in random order.
    sizes = sorted(ratios, key=lambda size: int(size.split('x')[0]))
    order = ['default', 'default_with_truth', *names]
    rows = []
    for name in sorted(by_scene, key=order.index):
        cells = [name.replace('_', ' ')]
        for size in sizes:
            time = by_scene[name][size]
            cells += [f'{time:.1f}', f'+{max(time - by_scene["default"][size], 0):.1f}']
        rows.append(cells)
    head = ['scene']
    for size in sizes:
        head += [f'{size}: us a frame', 'beside `default`']
    bare = ', '.join(f'{ratios[size]:.3f} at {size}' for size in sizes)
    return (f'{table(head, rows)}\n\n`default` against a loop that only paints background and '
            f'mover, in turn in one run, median over median: {bare}.')


def main():
    page, notebook, folder = sys.argv[1:]
    reference = read(os.path.join(folder, 'reference.md'))
    names = re.findall(r'^\| \*\*`([a-z-]+)`', reference, re.M)
    put(page, {'reference': reference})
    put(notebook, {'times': times(os.path.join(folder, 'times.json'), names)})


main()
