# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts the tables of accuracy-cost between the markers of docs/accuracy-vs-time.md and its notebook, and draws
their plots. Says which of the promised growths and errors do not hold.

Usage: accuracy_page.py PAGE NOTEBOOK PLOT_FOLDER RESULTS
"""
import os
import sys

import accuracy_plots
import accuracy_results as results
from accuracy_results import Setting, WHOLE
from page import figure, machine, put, read, table

SCENES = (('real', 'real'), ('scene', 'scenes'))


def properties(setting):
    if setting.method in results.PEERS:
        return setting.method
    parts = [f'method={setting.method}', f'window-size={setting.window}']
    if setting.solver != 'auto':
        parts.append(f'solver={setting.solver}')
    if setting.rank or setting.method != 'robust':
        parts.append(f'rank={setting.rank}')
    if setting.step > (0 if setting.method == 'robust' else 1):
        parts.append(f'sample-step={setting.step}')
    if setting.iterations > 1:
        parts.append(f'iterations={setting.iterations}')
    return '`' + ' '.join(parts) + '`'


class Quality:
    def __init__(self, rows):
        self.means = {scenes: results.means(rows, scenes) for scenes, _ in SCENES}
        self.shown = [(scenes, title) for scenes, title in SCENES if self.means[scenes]]

    def head(self):
        cells = []
        for _, title in self.shown:
            cells += [f'{title}: AGE', 'PSNR, dB', 'CQM, dB', 'ms a frame', 'spread']
        return cells + ['peak, MB']

    def cells(self, setting):
        """None where it was not measured."""
        cells, peak = [], 0
        for scenes, _ in self.shown:
            values = self.means[scenes].get(setting)
            if not values:
                return None
            peak = max(peak, values['peak_mb'])
            cells += ['', '', ''] if values['age'] is None else [
                f'{values["age"]:.2f}', f'{values["psnr"]:.1f}', f'{values["cqm"]:.1f}']
            cells += [figure(values['ms']),
                      f'{figure(values["ms_low"])} to {figure(values["ms_high"])}']
        return cells + [f'{peak:.0f}']

    def table(self, first, rows):
        """rows: [(text, setting)]"""
        filled = [(text, self.cells(setting)) for text, setting in rows]
        return table([first, *self.head()],
                     [[text, *cells] for text, cells in filled if cells is not None])

    def front(self):
        parts = []
        for scenes, title in self.shown:
            rows = []
            for setting in results.front(self.means[scenes]):
                values = self.means[scenes][setting]
                rows.append([properties(setting), f'{values["age"]:.2f}', figure(values['ms']),
                             figure(1000 / values['ms'])])
            parts.append(table([f'{title}: on the front', 'AGE', 'ms a frame',
                                'frames a second'], rows))
        return '\n\n'.join(parts)

    def knobs(self):
        robust = Setting('robust', 'auto', 0, 0, WHOLE, 1)
        qdmd = Setting('qdmd', 'auto', 1, 1, WHOLE, 1)
        rows = [('`robust`, everything in one window', robust)]
        rows += [(f'its `window-size={window}`' +
                  (' (the default)' if window == results.DEFAULT.window else ''),
                  robust._replace(window=window)) for window in (200, 100, 50, 25)]
        rows += [(f'its `iterations={count}`', robust._replace(iterations=count))
                 for count in (2, 4)]
        rows.append(('its `window-size=50 iterations=2`',
                     robust._replace(window=50, iterations=2)))
        rows += [(f'its `rank={rank}`', robust._replace(rank=rank)) for rank in (2, 3)]
        rows += [(f'its `sample-step={step}`', robust._replace(step=step))
                 for step in (1, 4, 8, 16)]
        for rank, name in ((1, '`rank=1`'), (3, '`rank=3`'), (0, 'full rank')):
            rows.append((f'`qdmd`, {name}, one window', qdmd._replace(rank=rank)))
        rows += [(f'`qdmd rank={rank} window-size={window}`',
                  qdmd._replace(rank=rank, window=window)) for window in (100, 50, 25)
                 for rank in (1, 0)]
        rows += [(f'`dmd`, rank {rank or "full"}, one window',
                  qdmd._replace(method='dmd', rank=rank)) for rank in (1, 0)]
        names = {'mog2': 'OpenCV MOG2', 'knn': 'OpenCV KNN',
                 'segmentation': '`segmentation` (a mask alone)'}
        rows += [(names.get(peer, peer),
                  Setting(peer, '-', 0, 1, WHOLE, 1)) for peer in results.PEERS]
        return self.table('what', rows)

    def digits(self):
        """The same settings by other solvers."""
        rows = []
        for window, solvers in ((25, ('auto', 'gram', 'gram-extended', 'qr')),
                                (100, ('auto', 'gram', 'gram-extended'))):
            for rank in (1, 0):
                rows += [(f'`qdmd window-size={window} rank={rank} solver={solver}`',
                          Setting('qdmd', solver, rank, 1, window, 1)) for solver in solvers]
        return self.table('what', rows)

    def wishes(self):
        scenes = self.shown[0][0]
        means = self.means[scenes]
        choices = [
            ('nothing to think about', results.DEFAULT),
            ('the best background, and can wait', Setting('robust', 'auto', 0, 0, WHOLE, 1)),
            ('less delay and memory', Setting('robust', 'auto', 0, 0, 50, 1)),
            ('the least time and delay', Setting('qdmd', 'auto', 1, 1, 25, 1)),
            ('one steady background for little time', Setting('qdmd', 'auto', 1, 8, WHOLE, 1)),
            ('the paper\'s decomposition, full rank', Setting('qdmd', 'auto', 0, 1, WHOLE, 1)),
            ('its digits for nearly dependent frames',
             Setting('qdmd', 'gram-extended', 0, 1, 100, 1)),
        ]
        rows = []
        for wish, setting in choices:
            values = means.get(setting)
            if values:
                rows.append([wish, properties(setting), f'{values["age"]:.2f}',
                             figure(values['ms']), f'{values["peak_mb"]:.0f}',
                             f'{setting.window - 1} frames'])
        return table(['if you want', 'set', f'AGE ({dict(SCENES)[scenes]})', 'ms a frame',
                      'peak, MB', 'delay'], rows)


def sampling_table(rows):
    found = results.chosen(rows, part='quality', method='qdmd', solver='auto', window=WHOLE)
    steps = sorted({row['step'] for row in found if row['step'] > 1})
    lines = []
    for rank, name in ((1, '1'), (3, '3'), (0, 'full')):
        group = results.chosen(found, rank=rank)
        for clip in dict.fromkeys(row['name'] for row in group):
            cells = [results.chosen(group, name=clip, step=step) for step in [1, *steps]]
            if all(cells):
                lines.append([name, clip, *(f'{cell[0]["moved"]:.2f}' for cell in cells[1:]),
                              *(f'{cell[0]["age"]:.2f}' for cell in cells)])
    return table(['rank', 'clip', *(f'step {step:.0f}: moved' for step in steps),
                  'step 1: AGE', *(f'step {step:.0f}: AGE' for step in steps)], lines)


def solvers_table(rows):
    found = results.chosen(rows, part='error', scenes='solvers')
    solvers = ('gram', 'gram-extended', 'qr', 'adjoint')
    lines = []
    for name, window, rank in dict.fromkeys((row['name'], row['window'], row['rank'])
                                            for row in found):
        group = {row['solver']: row
                 for row in results.chosen(found, name=name, window=window, rank=rank)}
        if 'gram' not in group:
            continue
        cells = [f'{group[solver]["lambda_error"]:.0e} / {group[solver]["background_error"]:.0e}, '
                 f'{figure(group[solver]["ms"])}' if solver in group else '' for solver in solvers]
        lines.append([name, f'{window:.0f}', f'{rank:.0f}' if rank else 'full',
                      figure(group['gram']['condition']), *cells])
    return table(['scene', 'frames', 'rank', 'condition', *(f'`{solver}`' for solver in solvers)],
                 lines)


def growth_table(rows):
    lines = []
    for line in results.LINES:
        cells = [line.title]
        for along in results.GROWS:
            points, slope = results.growth(rows, line, along)
            fitted = [point for point in points
                      if along == 'width' or point[0] >= line.first_window]
            cells += ['', ''] if slope is None else [
                f'{slope:.2f}', f'{figure(fitted[0][1])} ({fitted[0][0]:.0f}) to '
                f'{figure(fitted[-1][1])} ({fitted[-1][0]:.0f})']
        lines.append(cells)
    return table(['what', 'exponent in pixels', 'ms a window (pixels)', 'exponent in the window',
                  'ms a window (frames)'], lines)


def budget_table(rows):
    lines = []
    for scene, mode, loaded, of_budget in results.budgets(rows):
        for row in of_budget:
            budget = f'{row["budget_ms"]:.0f} ms' if row['budget_ms'] else 'none'
            means = [row['before_ms'], row['first_ms'], row['after_ms']] if loaded else [row['ms']]
            lines.append([f'{mode}, {scene}', 'from half-way on' if loaded else 'none', budget,
                          ' / '.join(figure(mean) for mean in means), f'{row["age"]:.2f}',
                          f'{row["found_period"]:.0f}', f'{row["found_step"]:.0f}',
                          f'{row["changes"]:.0f}'])
    return table(['mode, scene', 'load', 'budget', 'ms a frame', 'AGE', 'one solve in',
                  'sample step', 'changes'], lines)


def conditions(folder):
    seconds = os.path.join(folder, 'seconds')
    took = f' It took {int(read(seconds)) / 60:.0f} minutes.' if os.path.exists(seconds) else ''
    return f'{machine(folder)}{took} A load above 1 means that others used the machine.'


def clips(rows):
    """Which clips the table has: a run that was interrupted has fewer."""
    lines = []
    for scenes, title in SCENES:
        names = dict.fromkeys(row['name'] for row in results.chosen(rows, part='quality',
                                                                   scenes=scenes))
        lines.append(f'- {title} ({len(names)}): {", ".join(names) or "none"}')
    return '\n'.join(lines)


def main():
    page, notebook, plots, folder = sys.argv[1:]
    rows = results.read(os.path.join(folder, 'table.csv'))
    checks = results.checks(rows)
    quality = Quality(rows)
    put(page, {'wishes': quality.wishes()})
    put(notebook, {
        'machine': conditions(folder),
        'clips': clips(rows),
        'front': quality.front(),
        'knobs': quality.knobs(),
        'digits': quality.digits(),
        'sampling': sampling_table(rows),
        'checks': table(['what', 'measured', 'promised', 'holds'],
                        [[*check[:3], '**no**' if check[3] == 'no' else check[3]] for check in checks]),
        'solvers': solvers_table(rows),
        'growth': growth_table(rows),
        'budget': budget_table(rows),
    })
    accuracy_plots.draw(plots, rows)
    for what, measured, promised, holds in checks:
        print(f'{"holds" if holds == "yes" else "DOES NOT HOLD (" + holds + ")"}: {what}: '
              f'{measured}, promised {promised}')


main()
