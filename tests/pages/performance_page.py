# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts measured tables between the markers of docs/performance.md and its notebook, and draws their plots.

Usage: performance_page.py PAGE NOTEBOOK PLOT_FOLDER RESULTS
"""
import json
import os
import re
import sys

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt

from page import figure, machine, put, read, table

PEERS = (('robust', 'method=robust'), ('qdmd', 'method=qdmd'), ('qdmd_rank_1', 'method=qdmd rank=1'),
         ('qdmd_live', 'method=qdmd mode=live'), ('segmentation', 'segmentation'), ('mog2', 'OpenCV MOG2'),
         ('knn', 'OpenCV KNN'), ('cnt', 'OpenCV CNT'), ('median', 'median'))
STAGES = ('conversion', 'Gram', 'solve', 'combination', 'statistics', 'output')
# Colours of Okabe and Ito, told apart by all eyes.
COLOURS = ('#000000', '#0072B2', '#56B4E9', '#009E73', '#D55E00', '#E69F00', '#CC79A7', '#999999',
           '#F0E442')
# The share of memory's speed below which a pass computes, and from which on it waits for memory.
ARITHMETIC_BELOW, MEMORY_FROM = 0.5, 0.8


class Results:
    def __init__(self, folder):
        self.folder = folder
        self.element = self.benchmarks('element', r'frame/(\d+)x(\d+)/window:(\d+)')
        self.stages = self.benchmarks('stages', r'stages/(\d+)x(\d+)/window:(\d+)/threads:(\d+)')
        self.passes = self.benchmarks('passes', r'([a-z_]+)/(\d+)x(\d+)')
        self.gram = self.benchmarks('gram', r'(.+)')
        self.outputs = self.benchmarks('separate', r'outputs/(\d+)x(\d+)/window:(\d+)/(\w+)')

    def text(self, name):
        return read(os.path.join(self.folder, name))

    def benchmarks(self, name, pattern):
        """{what the pattern finds, numbers as such: counters}"""
        found = {}
        for run in json.loads(self.text(name + '.json'))['benchmarks']:
            match = re.match(pattern, run['name'])
            if match:
                key = tuple(int(part) if part.isdigit() else part for part in match.groups())
                found[key] = run
        return found

    def live(self, name):
        """{name of a line: {name of a figure: value}}"""
        lines = {}
        for line in self.text(name).splitlines():
            words = line.split()
            if words and words[0] != 'stream':
                pairs = words[1:] if len(words) % 2 else [''] + words[1:]
                lines[words[0]] = {key: float(value)
                                   for key, value in zip(pairs[::2], pairs[1::2])}
        return lines


def peers_table(results, counter):
    listed = [peer for peer in PEERS if any(f'{counter}/{peer[0]}' in run
                                            for run in results.element.values())]
    rows = []
    for (width, height, window), run in sorted(results.element.items(), key=size_order):
        cells = [figure(run.get(f'{counter}/{name}')) for name, _ in listed]
        rows.append([f'{width}x{height}, {window}', *cells])
    return table(['size, window-size', *(title for _, title in listed)], rows)


def size_order(item):
    width, height, window = item[0][:3]
    return width * height, window


def promises(results):
    rows = []
    for case, least in (((320, 240, 200), 3), ((768, 576, 200), 2), ((1920, 1080, 60), 3)):
        run = results.element.get(case)
        if run:
            rows.append([f'{case[0]}x{case[1]}', str(case[2]), figure(run['net/qdmd']),
                         figure(run['net/segmentation']), figure(run['times/qdmd']), f'{least}',
                         figure(run['cpu/segmentation'] / run['cpu/qdmd'])])
    return table(['size', 'window-size', 'method=qdmd, ms', 'segmentation, ms',
                  'times as fast', 'promised', 'times less processor time'], rows)


def stages_table(results):
    rows = []
    for (width, height, window, threads), run in sorted(
            results.stages.items(), key=lambda item: (item[0][3], *size_order(item))):
        rows.append([f'{width}x{height}, {window}', str(threads),
                     *(figure(run[f'ms/{stage}']) for stage in STAGES),
                     figure(run['ms/total'])])
    return table(['size, window-size', 'threads', *STAGES, 'total'], rows)


def passes_table(results):
    names = list(dict.fromkeys(key[0] for key in results.passes))
    sizes = sorted({key[1:] for key in results.passes})
    rows = []
    for name in names:
        cells = []
        for size in sizes:
            run = results.passes.get((name, *size), {})
            cells += [figure(run.get('ns/pixel')), figure(run.get('GB/s')),
                      figure(run.get('of_memory'))]
        run = results.passes.get((name, *sizes[0]), {})
        rows.append([name, figure(run.get('bytes/pixel')), *cells])
    head = ['pass', f'bytes a pixel at {sizes[0][0]}x{sizes[0][1]}']
    for width, height in sizes:
        head += [f'{width}x{height}: ns a pixel', 'GB/s', 'of memory']
    return table(head, rows)


def best_gram(results, size):
    """Name and counters of the fastest kernel on one thread for pictures of this size."""
    runs = [(key[0], run) for key, run in results.gram.items()
            if f'/{size}/threads:1' in key[0] and 'slices' not in key[0] and 'GMAC/s' in run]
    return max(runs, key=lambda item: item[1]['GMAC/s'], default=(None, {}))


def gram_table(results):
    rows = [[key[0].replace('/real_time', '').replace('/manual_time', ''), figure(run['GMAC/s']),
             figure(run.get('of_peak'))]
            for key, run in results.gram.items() if 'GMAC/s' in run]
    return table(['kernel, frames, size', 'GMAC/s', 'of the peak'], rows)


def bounds_table(results):
    def verdict(share):
        if share >= MEMORY_FROM:
            return 'memory'
        return 'arithmetic' if share < ARITHMETIC_BELOW else 'both'

    rows = []
    sizes = sorted({key[1:] for key in results.passes})

    def row(stage, name):
        cells = [stage]
        for size in sizes:
            run = results.passes.get((name, *size))
            share = run.get('of_memory') if run else None
            cells.append(f'{verdict(share)} ({figure(share)} of memory, {figure(run["GB/s"])} GB/s)'
                         if share else '')
        rows.append(cells)

    row('conversion', 'split_channels')
    cells = ['Gram']
    for width, height in sizes:
        _, run = best_gram(results, f'{width}x{height}')
        cells.append(f'arithmetic ({figure(run["of_peak"])} of the peak, {figure(run["GMAC/s"])} '
                     'GMAC/s)' if run.get('of_peak') else '')
    rows.append(cells)
    cells = ['solve']
    for width, height in sizes:
        shares = [run['ms/solve'] / run['ms/total'] for key, run in results.stages.items()
                  if key[:2] == (width, height)]
        cells.append(f'arithmetic, no pixels ({figure(100 * min(shares))} to '
                     f'{figure(100 * max(shares))} % of a frame)' if shares else '')
    rows.append(cells)
    row('combination', 'combine_planes')
    row('output', 'write_mask')
    return table(['stage', *(f'{width}x{height}' for width, height in sizes)], rows)


OUTPUTS = (('background', 'background'), ('mask', 'mask'), ('background_mask', 'both'),
           ('mask_cutout', 'mask and cutout'), ('all', 'all four'), ('two_elements', 'two elements'))


def outputs_table(runs):
    """Of several pictures at once; runs: {(width, height, window, mode): counters}"""
    rows = []
    for (width, height, window, mode), run in sorted(
            runs.items(), key=lambda item: (item[0][0] * item[0][1], item[0][3])):
        for unit, title in (('cpu', 'processor'), ('ms', 'clock')):
            times = [run[f'{unit}/{name}'] for name, _ in OUTPUTS]
            rows.append([f'{width}x{height}, {window}, {mode}', title, *map(figure, times),
                         figure(times[2] / max(times[0], times[1]))])
    return table(['size, window-size, mode', 'ms a frame', *(title for _, title in OUTPUTS),
                  'both / the longer one'], rows)


def live_table(results):
    def column(method):
        live, small = (results.live(f'{name}-{method}.txt') for name in ('live-1080p', 'live-320x240'))

        def three(line):
            return ', '.join(figure(live[line][key]) for key in ('p50', 'p99', 'max'))
        resident = small.get('resident_mb', {})
        return [f'{live["frames"]["in"]:.0f}, {live["frames"]["dropped"]:.0f}', three('in_element_ms'),
                three('after_capture_ms'), three('after_two_seconds_ms'), figure(live['cpu_ms_per_frame']['']),
                f'{figure(resident.get("first_full"))}, {figure(resident.get("last"))}',
                *(f'{results.live(f"memory-{mode}-{method}.txt")["peak_mb"][""]:.0f}' for mode in ('batch', 'live'))]
    small, peak = results.live('live-320x240-qdmd.txt'), results.live('memory-batch-qdmd.txt')['peak_mb']
    of_window = f'peak of the process, MB (the window: {peak["window"]:.0f})'
    titles = ['1080p in real time: frames in, dropped', 'time in the element, ms: median, p99, longest',
              'capture to the screen\'s door, ms: median, p99, longest', 'the same, without the first two seconds',
              'processor time of the whole process, ms a frame',
              f'320x240, {small["frames"]["in"]:.0f} frames: resident MB, window full, at the end',
              f'1080p, mode=batch window-size=100: {of_window}', f'1080p, mode=live window-size=100: {of_window}']
    promised = ['0 dropped', 'p99 below 40', '', '', '', 'flat', *2 * [f'below {peak["limit"]:.0f}']]
    return table(['what', 'default', '`method=qdmd`', 'promised for `qdmd`'],
                 [list(row) for row in zip(titles, column('robust'), column('qdmd'), promised)])


def lines(axis, results, cases, horizontal):
    for (name, title), colour in zip(PEERS, COLOURS):
        points = sorted((horizontal(case), run[f'net/{name}'])
                        for case, run in results.element.items()
                        if case in cases and run.get(f'net/{name}', 0) > 0)
        if points:
            own = name.startswith('qdmd')
            axis.plot(*zip(*points), marker='o', markersize=4, color=colour, label=title,
                      linewidth=2 if own else 1, linestyle='-' if own else '--')
    axis.set_xscale('log')
    axis.set_yscale('log')
    axis.set_ylabel('ms a frame, less identity')
    axis.grid(True, which='major', alpha=0.3)
    axis.legend(fontsize=7, loc='upper center', bbox_to_anchor=(0.5, -0.16), ncol=4)


def bars(axis, results, cases, label):
    """Stages on one thread, in nanoseconds a pixel, so that sizes can be compared."""
    shown = [case for case in cases if (*case, 1) in results.stages]
    bottom = [0.0] * len(shown)
    for stage, colour in zip(STAGES, COLOURS):
        heights = [1e6 * results.stages[(*case, 1)][f'ms/{stage}'] / (case[0] * case[1])
                   for case in shown]
        axis.bar(range(len(shown)), heights, bottom=bottom, color=colour, label=stage)
        bottom = [a + b for a, b in zip(bottom, heights)]
    axis.set_xticks(range(len(shown)), [label(case) for case in shown], fontsize=7)
    axis.set_ylabel('ns a pixel and frame, one thread')
    axis.grid(True, axis='y', alpha=0.3)
    axis.legend(fontsize=7, loc='upper center', bbox_to_anchor=(0.5, -0.16), ncol=4)


def plot(path, results, cases, horizontal, title, label):
    cases = sorted(cases, key=lambda case: (case[0] * case[1], case[2]))
    with plt.rc_context({'svg.hashsalt': 'qdmd', 'font.size': 9}):
        drawing, (left, right) = plt.subplots(1, 2, figsize=(10, 4.6), layout='constrained')
        lines(left, results, cases, horizontal)
        left.set_xlabel(title)
        bars(right, results, cases, label)
        right.set_xlabel(title)
        drawing.savefig(path, metadata={'Date': None})
        plt.close(drawing)


def main():
    page, notebook, plots, folder = sys.argv[1:]
    results = Results(folder)
    put(page, {'live': live_table(results), 'outputs': outputs_table(results.outputs)})
    put(notebook, {
        'machine': machine(folder) + ' A load above what the benchmark itself makes means that '
                   'others used the machine.',
        'promises': promises(results),
        'peers': peers_table(results, 'net'),
        'processor': peers_table(results, 'cpu'),
        'stages': stages_table(results),
        'bounds': bounds_table(results),
        'passes': passes_table(results),
        'gram': gram_table(results),
        'adjoint': results.text('adjoint.txt').partition('\n\n')[2],
    })

    plot(os.path.join(plots, 'size.svg'), results,
         [case for case in results.element if case[2] == 100], lambda case: case[0] * case[1],
         'pixels, window-size=100', lambda case: f'{case[0]}x{case[1]}')
    plot(os.path.join(plots, 'window.svg'), results,
         [case for case in results.element if case[:2] == (320, 240)], lambda case: case[2],
         'window-size, 320x240', lambda case: str(case[2]))


main()
