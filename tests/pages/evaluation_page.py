# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts measured and quoted tables between the markers of docs/evaluation.md and its notebook, and draws its plot.

Usage: evaluation_page.py PAGE NOTEBOOK PAPER_CSV PLOT_SVG TABLES
"""
import csv
import glob
import json
import math
import os
import statistics
import sys

from page import put, table

MEASURES = ('AGE', 'pEPs', 'pCEPs', 'MSSSIM', 'PSNR', 'CQM')
DERIVED = ('Board', 'Foliage', 'office')  # whose truth was computed from masks


def short(name):
    return name.rsplit('/', 1)[-1]


def load(folder):
    """{run: {(sequence, method): row}}"""
    runs = {}
    for path in glob.glob(os.path.join(folder, '*.json')):
        with open(path) as file:
            rows = json.load(file)
        runs[os.path.splitext(os.path.basename(path))[0]] = {
            (short(row['sequence']), row['method']): row for row in rows}
    return runs


def number(value, measure):
    if value is None or value == '':
        return ''
    digits = {'AGE': 2, 'PSNR': 2, 'CQM': 2, 'seconds': 2}.get(measure, 4)
    return f'{float(value):.{digits}f}'


def titled(sequence):
    return sequence + (' (derived)' if sequence in DERIVED else '')


def sequences_of(run):
    seen = []
    for sequence, _ in run:
        if sequence not in seen:
            seen.append(sequence)
    return seen


# Name in the tables, run, method.
def variants(runs):
    listed = [('qdmd', 'whole', 'qdmd'), ('qdmd, first-frame', 'whole-first-frame', 'qdmd'),
              ('qdmd, rank 1', 'whole-rank-1', 'qdmd'),
              ('qdmd, omega 0.01', 'whole-neighbours', 'qdmd'), ('dmd', 'whole', 'dmd'),
              ('dmd, first-frame', 'whole-first-frame', 'dmd'),
              ('dmd, rank 1', 'whole-rank-1', 'dmd'),
              ('dmd, omega 0.01', 'whole-neighbours', 'dmd')]
    known = {method for _, _, method in listed}
    for _, method in runs['whole']:
        if method not in known:
            known.add(method)
            listed.append((method, 'whole', method))
    return listed


def overview(runs):
    columns = variants(runs)
    rows = []
    for sequence in sequences_of(runs['whole']):
        values = [runs[run][sequence, method]['AGE'] for _, run, method in columns]
        best = min(values)
        cells = [f'**{v:.2f}**' if v == best else f'{v:.2f}' for v in values]
        frames = runs['whole'][sequence, 'qdmd']['frames']
        rows.append([f'{titled(sequence)}, {frames}'] + cells)
    means = [statistics.mean(runs[run][s, method]['AGE'] for s in sequences_of(runs['whole']))
             for _, run, method in columns]
    rows.append(['*mean*'] + [f'{v:.2f}' for v in means])
    return table(['AGE: sequence, frames'] + [name for name, _, _ in columns], rows)


def six_measures(runs):
    rows = []
    for sequence in sequences_of(runs['whole']):
        for name, run, method in variants(runs):
            row = runs[run][sequence, method]
            rows.append([titled(sequence), name] + [number(row[m], m) for m in MEASURES] +
                        [number(row['seconds'], 'seconds')])
    return table(['sequence', 'method', *MEASURES, 'seconds'], rows)


def masks(runs):
    rows = []
    for sequence in sequences_of(runs['whole']):
        for name, run, method in variants(runs):
            row = runs[run][sequence, method]
            if row['F'] is not None:
                rows.append([sequence, name] +
                            [f'{row[m]:.3f}' for m in ('precision', 'recall', 'F')])
    return table(['sequence', 'method', 'precision', 'recall', 'F'], rows)


def excerpts(runs, sequence, method, setting):
    """A row for each start frame; that of the whole sequence where it has at most 200 frames."""
    end = '' if setting == 'window' else '-' + setting
    found = [runs[f'excerpt-{sequence}-{k}{end}'][sequence, method] for k in range(5)
             if f'excerpt-{sequence}-{k}{end}' in runs]
    return found or [runs['whole' + end][sequence, method]]


def spread_cell(rows, measure='AGE'):
    values = sorted(row[measure] for row in rows)
    if len(values) == 1:
        return f'{values[0]:.2f}'
    return f'{values[0]:.2f} .. **{statistics.median(values):.2f}** .. {values[-1]:.2f}'


def spread(runs):
    columns = [('qdmd', 'qdmd', 'window'), ('qdmd, first-frame', 'qdmd', 'first-frame'),
               ('qdmd, omega 0.01', 'qdmd', 'neighbours'),
               ('dmd', 'dmd', 'window'), ('dmd, first-frame', 'dmd', 'first-frame'),
               ('dmd, omega 0.01', 'dmd', 'neighbours'), ('median', 'median', 'window')]
    rows = []
    for sequence in sequences_of(runs['whole']):
        if f'excerpt-{sequence}-0' in runs:
            rows.append([titled(sequence)] + [spread_cell(excerpts(runs, sequence, method, a))
                                              for _, method, a in columns])
    return table(['AGE over five starts'] + [name for name, _, _ in columns], rows)


def pictures(runs):
    rows = []
    for sequence in sequences_of(runs['whole']):
        for method in ('qdmd', 'dmd'):
            row = [runs[run][sequence, method]['AGE'] for run in
                   ('picture-first', 'whole', 'picture-last', 'picture-median')]
            rows.append([titled(sequence), method] + [f'{value:.2f}' for value in row])
    return table(['AGE of L(t)', 'method', 'first', 'middle', 'last', 'median over t'], rows)


def paper_rows(paper, name):
    return [row for row in paper if row['table'] == name]


def beside_paper(runs, paper):
    rows = []
    for quoted in paper_rows(paper, 'SBI') + paper_rows(paper, 'SBMnet'):
        sequence = quoted['sequence']
        rows.append([sequence, f'paper, {quoted["method"]}'] +
                    [number(quoted[m], m) for m in MEASURES])
        if quoted['method'] == 'DMD' or (sequence, 'qdmd') not in runs['whole']:
            continue
        for amplitude in ('first-frame', 'window'):
            for method in ('dmd', 'qdmd'):
                row = excerpts(runs, sequence, method, amplitude)[0]
                rows.append([titled(sequence), f'ours, {method}, {amplitude}'] +
                            [number(row[m], m) for m in MEASURES])
    return table(['sequence', 'method', *MEASURES], rows)


def published(paper):
    quoted = paper_rows(paper, 'SBMnet-published')
    methods, sequences = [], []
    for row in quoted:
        if row['method'] not in methods:
            methods.append(row['method'])
        if row['sequence'] not in sequences:
            sequences.append(row['sequence'])
    cells = {(row['sequence'], row['method']): row for row in quoted}
    rows = []
    for sequence in sequences:
        for measure in ('AGE', 'MSSSIM', 'PSNR', 'CQM'):
            rows.append([sequence, measure] +
                        [number(cells[sequence, method][measure], measure) for method in methods])
    return table(['sequence', ''] + methods, rows)


def coupling(runs):
    """How far the two methods' scores are apart, amplitude=window, on all sequences."""
    rows = []
    for sequence in sequences_of(runs['whole']):
        q, d = (runs['whole'][sequence, method] for method in ('qdmd', 'dmd'))
        starts = [a['AGE'] - b['AGE'] for a, b in
                  zip(excerpts(runs, sequence, 'qdmd', 'window'),
                      excerpts(runs, sequence, 'dmd', 'window'))]
        better = sum(difference < 0 for difference in starts)
        rows.append([titled(sequence), f'{q["AGE"] - d["AGE"]:+.3f}', f'{q["PSNR"] - d["PSNR"]:+.3f}',
                     f'{q["CQM"] - d["CQM"]:+.3f}', f'{better} of {len(starts)}'])
    return table(['qdmd minus dmd', 'AGE', 'PSNR', 'CQM', 'excerpts with lower AGE'], rows)


def plot(runs, paper, path):
    """AGE of excerpts (dots) and of the paper (bars) on a logarithmic axis."""
    kinds = [('qdmd', 'window', '#1f6fb4'), ('qdmd', 'first-frame', '#7fb8e6'),
             ('dmd', 'window', '#c4571a'), ('dmd', 'first-frame', '#efa776')]
    left, width, line, top = 150, 560, 15, 42
    low, high = 2.0, 65.0

    def x(value):
        share = math.log(min(max(value, low), high) / low) / math.log(high / low)
        return left + width * share

    quoted = {(row['sequence'], row['method']): float(row['AGE'])
              for row in paper if row['table'] in ('SBI', 'SBMnet')}
    shapes, y = [], top
    for sequence in sequences_of(runs['whole']):
        shapes.append(f'<text x="{left - 10}" y="{y + 2 * line}" text-anchor="end">'
                      f'{sequence}</text>')
        for method, amplitude, colour in kinds:
            y += line
            for row in excerpts(runs, sequence, method, amplitude):
                shapes.append(f'<circle cx="{x(row["AGE"]):.1f}" cy="{y - 4}" r="4" '
                              f'fill="{colour}" fill-opacity="0.8"/>')
            value = quoted.get((sequence, 'Q-DMD' if method == 'qdmd' else 'DMD'))
            if value and amplitude == 'first-frame':
                shapes.append(f'<path d="M{x(value):.1f} {y - 11}v14" stroke="#000" '
                              'stroke-width="2"/>')
        y += line
        shapes.append(f'<path d="M{left} {y - 5}h{width}" stroke="#ddd"/>')
    grid = []
    for value in (2, 3, 5, 10, 20, 30, 60):
        grid.append(f'<path d="M{x(value):.1f} {top - 8}V{y}" stroke="#eee"/>'
                    f'<text x="{x(value):.1f}" y="{y + 16}" text-anchor="middle">{value}</text>')
    legend, at = [], left
    for method, amplitude, colour in kinds:
        legend.append(f'<circle cx="{at}" cy="16" r="4" fill="{colour}"/>'
                      f'<text x="{at + 8}" y="20">{method}, {amplitude}</text>')
        at += 135
    legend.append(f'<path d="M{at} 9v14" stroke="#000" stroke-width="2"/>'
                  f'<text x="{at + 8}" y="20">paper</text>')
    with open(path, 'w') as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + width + 70}" '
                   f'height="{y + 44}" font-family="sans-serif" font-size="12">'
                   '<rect width="100%" height="100%" fill="#fff"/>'
                   + '\n'.join(grid + shapes + legend) +
                   f'<text x="{left + width / 2}" y="{y + 36}" text-anchor="middle">'
                   'AGE (levels of luma, logarithmic)</text></svg>\n')


def main():
    page, notebook, paper_csv, plot_svg, folder = sys.argv[1:]
    runs = load(folder)
    with open(paper_csv) as file:
        paper = list(csv.DictReader(file))
    put(page, {'overview': overview(runs)})
    put(notebook, {
        'coupling': coupling(runs), 'spread': spread(runs), 'pictures': pictures(runs), 'masks': masks(runs),
        'paper': beside_paper(runs, paper), 'published': published(paper), 'measures': six_measures(runs),
    })
    plot(runs, paper, plot_svg)


if __name__ == '__main__':
    main()
