# SPDX-License-Identifier: LGPL-2.1-or-later
"""The plots of docs/accuracy-vs-time.md."""
import math
import os
import statistics

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt
from matplotlib.ticker import LogLocator, NullFormatter

import accuracy_results as results

# Colours of Okabe and Ito, told apart by all eyes.
SOLVERS = {'gram': '#D55E00', 'gram-extended': '#0072B2', 'qr': '#009E73', 'adjoint': '#999999'}
METHODS = {'robust': '#0072B2', 'qdmd': '#D55E00', 'dmd': '#E69F00', 'median': '#009E73',
           'mean': '#999999', 'mog2': '#CC79A7', 'knn': '#56B4E9'}
RANKS = {1: ('#0072B2', 'rank 1'), 3: ('#E69F00', 'rank 3'), 0: ('#D55E00', 'full rank')}
MARKERS = 'os^Dv'
# Errors of exactly nothing, on a logarithmic axis.
LEAST = 1e-17


def save(folder, name, drawing):
    drawing.savefig(os.path.join(folder, name + '.svg'), metadata={'Date': None})
    plt.close(drawing)


def panels(count, height=4.2):
    return plt.subplots(1, count, figsize=(10, height), layout='constrained', squeeze=False)


def finish(axis, title, x, y, legend=True, **options):
    axis.set_title(title, fontsize=9)
    axis.set_xlabel(x)
    axis.set_ylabel(y)
    axis.grid(True, which='major', alpha=0.3)
    if legend:
        axis.legend(fontsize=7, **options)


def error_against_condition(folder, rows):
    families = results.families(rows)
    shown = [(family, family, 'condition') for family in families]
    # Where the problem itself is worse than X, that is what decides.
    shown += [(family, family, 'sensitivity') for family in families
              if results.problem_condition(rows, family) > results.WITHIN]
    shown.append(('hard cases', 'tests/stability', 'condition'))
    drawing, axes = plt.subplots((len(shown) + 2) // 3, 3, figsize=(10, 8), layout='constrained')
    for axis in axes.flat[len(shown):]:
        axis.remove()
    for axis, (scenes, title, along) in zip(axes.flat, shown):
        found = results.chosen(rows, part='error', scenes=scenes)
        for solver, colour in SOLVERS.items():
            points = [(row[along], max(LEAST, results.error(row))) for row in found
                      if row['solver'] == solver and math.isfinite(results.error(row))]
            if points:
                axis.plot(*zip(*points), linestyle='none', marker='o', markersize=3, alpha=0.6,
                          color=colour, label=solver)
        of_x = along == 'condition'
        ends = (1, 1e7 if of_x else 1e11)
        lines = [('gram-extended', '-', 'condition eps')]
        if of_x:
            lines.insert(0, ('gram', '--', 'condition$^2$ eps'))
        for solver, style, label in lines:
            axis.plot(ends, [results.predicted(solver, end) for end in ends], style, color='black',
                      linewidth=1, label=label)
        axis.set(xscale='log', yscale='log', xlim=ends, ylim=(LEAST / 2, 10))
        finish(axis, title, 'condition number of X' if of_x else 'of the problem itself',
               'relative error, against 50 digits', legend=axis is axes.flat[0], loc='upper left')
    save(folder, 'error-condition', drawing)


def error_against_time(folder, rows):
    found = results.chosen(rows, part='error', scenes='solvers')
    ranks = [rank for rank in (0, 3, 1) if results.chosen(found, rank=rank)]
    drawing, axes = panels(len(ranks))
    windows = sorted({row['window'] for row in found})
    for axis, rank in zip(axes[0], ranks):
        for solver, colour in SOLVERS.items():
            for window, marker in zip(windows, MARKERS):
                group = results.chosen(found, rank=rank, solver=solver, window=window)
                if group:
                    axis.plot([row['ms'] for row in group],
                              [max(LEAST, results.error(row)) for row in group], linestyle='none',
                              marker=marker, markersize=5, color=colour,
                              label=f'{solver}, m = {window:.0f}')
        conditions = [row['condition'] for row in results.chosen(found, rank=rank)]
        axis.set(xscale='log', yscale='log')
        axis.set_ylim(1e-16, 1e-11)
        finish(axis, f'{RANKS[rank][1]}, condition {min(conditions):.0f} to '
               f'{max(conditions):.0f}' if rank != 1 else RANKS[rank][1], 'ms a frame',
               'relative error, against 50 digits', legend=rank == 0, loc='upper right')
    save(folder, 'error-time', drawing)


def label_of(setting):
    if setting.method in results.PEERS:
        return setting.method
    text = setting.method
    if setting.window != results.WHOLE:
        text += f' w{setting.window}'
    if setting.rank:
        text += f' r{setting.rank}'
    if setting.step > (0 if setting.method == 'robust' else 1):
        text += f' s{setting.step}'
    if setting.iterations > 1:
        text += f' i{setting.iterations}'
    return text


def quality_against_time(folder, rows):
    shown = [(scenes, title) for scenes, title in
             (('real', 'real sequences'), ('scene', 'simulated scenes'))
             if results.means(rows, scenes)]
    drawing, axes = panels(len(shown), 5)
    for axis, (scenes, title) in zip(axes[0], shown):
        points = results.means(rows, scenes)
        for method, colour in METHODS.items():
            group = [values for setting, values in points.items()
                     if setting.method == method and values['age'] is not None]
            if group:
                axis.plot([values['ms'] for values in group],
                          [values['age'] for values in group], linestyle='none',
                          marker='*' if method in results.PEERS else 'o',
                          markersize=10 if method in results.PEERS else 4, color=colour,
                          alpha=0.8, label=method)
        for setting, values in points.items():
            if values['age'] is None:
                axis.axvline(values['ms'], linestyle=':', color='#CC79A7', linewidth=1,
                             label=setting.method)
        front = results.front(points)
        axis.plot([points[setting]['ms'] for setting in front],
                  [points[setting]['age'] for setting in front], color='black', linewidth=1,
                  drawstyle='steps-post', zorder=0, label='Pareto front')
        for setting in front:
            axis.annotate(label_of(setting), (points[setting]['ms'], points[setting]['age']),
                          fontsize=6, xytext=(3, 3), textcoords='offset points')
        if results.DEFAULT in points:
            values = points[results.DEFAULT]
            axis.plot([values['ms']], [values['age']], marker='o', markersize=11, color='black',
                      markerfacecolor='none', linestyle='none', label='defaults')
        axis.set(xscale='log', yscale='log')
        axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.yaxis.set_major_formatter('{x:g}')
        axis.yaxis.set_minor_formatter(NullFormatter())
        finish(axis, title, 'ms a frame', 'AGE, mean over the clips', loc='best')
    save(folder, 'quality-time', drawing)


def growth(folder, rows):
    colours = ('#000000', '#D55E00', '#E69F00', '#CC79A7', '#0072B2', '#009E73', '#56B4E9',
               '#999999')
    drawing, axes = panels(2, 5)
    for axis, (along, title) in zip(axes[0], results.GROWS.items()):
        for line, colour in zip(results.LINES, colours):
            points, slope = results.growth(rows, line, along)
            if slope is not None:
                axis.plot(*zip(*points), marker='o', markersize=4, color=colour,
                          label=f'{line.title}: {slope:.2f}')
        axis.set(xscale='log', yscale='log')
        finish(axis, 'fitted exponents in the legend', title, 'ms a window', loc='upper left')
    save(folder, 'growth', drawing)


def sampling(folder, rows):
    drawing, axes = panels(2, 4.6)
    found = [row for row in results.chosen(rows, part='quality', method='qdmd', solver='auto',
                                           window=results.WHOLE)]
    steps = sorted({row['step'] for row in found})
    for rank, (colour, label) in RANKS.items():
        for axis, column in zip(axes[0], ('moved', 'age')):
            clips = {}
            for row in results.chosen(found, rank=rank):
                if row['step'] > (1 if column == 'moved' else 0):
                    clips.setdefault(row['name'], {})[row['step']] = row[column]
            if not clips:
                continue
            for values in clips.values():
                axis.plot(*zip(*sorted(values.items())), color=colour, alpha=0.25, linewidth=0.8)
            middle = [(step, statistics.median(values[step] for values in clips.values()))
                      for step in steps if all(step in values for values in clips.values())]
            if middle:
                axis.plot(*zip(*middle), color=colour, marker='o', markersize=4, linewidth=2,
                          label=label)
    for axis, title, y in zip(axes[0], ('how far sampling moves the background',
                                        'how good it is'),
                              ('levels from that of all pixels, worst frame', 'AGE')):
        axis.set(xscale='log', yscale='log')
        axis.set_xticks(steps, [f'{step:.0f}' for step in steps])
        axis.minorticks_off()
        finish(axis, title, 'sample-step', y, loc='best')
    save(folder, 'sampling', drawing)


def draw(folder, rows):
    with plt.rc_context({'svg.hashsalt': 'qdmd', 'font.size': 8}):
        for plot in (error_against_condition, error_against_time, quality_against_time, growth,
                     sampling):
            plot(folder, rows)
