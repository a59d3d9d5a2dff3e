# SPDX-License-Identifier: LGPL-2.1-or-later
"""What accuracy-cost wrote: rows, their averages, fits, and what was promised of them."""
import collections
import csv
import math
import statistics

EPSILON = 2.0 ** -52
NUMBERS = ('rank', 'step', 'window', 'iterations', 'width', 'height', 'turns', 'ms', 'ms_low',
           'ms_high', 'clock_ms', 'layout_mb', 'peak_mb', 'age', 'age_worst', 'psnr', 'cqm',
           'moved', 'condition', 'movement', 'sensitivity', 'lambda_error', 'background_error',
           'rank_found', 'dropped', 'budget_ms', 'before_ms', 'first_ms', 'after_ms', 'found_period',
           'found_step', 'found_iterations', 'changes')
# The multiple of a budget that a mean may reach.
OVER_BUDGET = 1.2
# The factor by which a prediction may be wrong, in both directions.
WITHIN = 100
# What grows: part, method, solver, rank, name, first window of the fit. Short windows have parts
# that grow more slowly: whole groups of frames in the Gram matrix, squares in the small problem.
Line = collections.namedtuple('Line', 'part method solver rank title first_window')
GRAM = Line('Gram', 'qdmd', 'gram', 0, 'Gram matrix', 100)
SOLVE = Line('solve', 'qdmd', 'gram', 0, 'small problem, gram, full rank', 200)
LINES = (GRAM, SOLVE,
         Line('solve', 'qdmd', 'gram', 1, 'small problem, gram, rank 1', 100),
         Line('solve', 'qdmd', 'auto', 0, 'small problem, auto (its bounds included), full rank', 200),
         Line('solve', 'qdmd', 'auto', 1, 'small problem, auto (its bounds included), rank 1', 100),
         Line('solve', 'qdmd', 'gram', 3, 'small problem, gram, rank 3', 100),
         Line('solve', 'qdmd', 'gram-extended', 0, 'small problem, gram-extended', 100),
         Line('solve', 'qdmd', 'qr', 0, 'small problem and its pixels, qr', 50),
         Line('engine', 'robust', 'gram', 0, 'everything, robust', 50),
         Line('engine', 'qdmd', 'gram', 0, 'everything, qdmd', 50))
# Line, column that grows, exponent, room.
PROMISED = ((GRAM, 'width', 1.0, 0.1), (GRAM, 'window', 2.0, 0.2), (SOLVE, 'window', 3.0, 0.4))
GROWS = {'width': 'pixels', 'window': 'frames of the window'}

Setting = collections.namedtuple('Setting', 'method solver rank step window iterations')
PEERS = ('median', 'mean', 'mog2', 'knn', 'segmentation')
DEFAULT = Setting('robust', 'auto', 0, 0, 100, 1)
WHOLE = 300  # a window that has every clip in it


def read(path):
    rows = []
    with open(path, newline='') as file:
        for row in csv.DictReader(file):
            for name in NUMBERS:
                row[name] = float(row[name]) if row[name] else None
            rows.append(row)
    return rows


def chosen(rows, **wanted):
    return [row for row in rows if all(row[name] == value for name, value in wanted.items())]


def setting_of(row):
    return Setting(row['method'], row['solver'], int(row['rank']), int(row['step']),
                   int(row['window']), int(row['iterations']))


def means(rows, scenes):
    """{setting: means over the clips}, of settings that every clip has. `segmentation` has no
    background, and no score."""
    rows = chosen(rows, part='quality', scenes=scenes)
    clips = {row['name'] for row in rows}
    by_setting = collections.defaultdict(list)
    for row in rows:
        by_setting[setting_of(row)].append(row)
    result = {}
    for setting, found in by_setting.items():
        if {row['name'] for row in found} != clips:
            continue
        result[setting] = {
            name: None if found[0][name] is None else statistics.fmean(row[name] for row in found)
            for name in ('age', 'age_worst', 'psnr', 'cqm', 'ms', 'ms_low', 'ms_high')}
        result[setting]['peak_mb'] = max(row['peak_mb'] for row in found)
        result[setting]['layout_mb'] = max(row['layout_mb'] or 0 for row in found) or None
    return result


def front(points):
    """Settings that no other beats in both AGE and time, the fastest first. Slower ones are better
    by a hundredth of a level at least."""
    best, kept = math.inf, []
    scored = {setting: values for setting, values in points.items() if values['age'] is not None}
    for setting, values in sorted(scored.items(), key=lambda item: (item[1]['ms'],
                                                                    item[1]['age'])):
        if values['age'] < best - 0.01:
            best = values['age']
            kept.append(setting)
    return kept


def exponent(points):
    """Least squares in logarithms of [(x, y)]."""
    if len({x for x, _ in points}) < 2:
        return None
    xs, ys = [math.log(x) for x, _ in points], [math.log(y) for _, y in points]
    return statistics.linear_regression(xs, ys).slope


def growth(rows, line, along):
    """[(pixels or frames, milliseconds for a window)], and the exponent; None: too few."""
    found = chosen(rows, part='scaling', name=line.part, method=line.method, solver=line.solver,
                   rank=line.rank)
    if not found:
        return [], None
    # The pixels grow at one window, the window at one size: the one that most rows have.
    if along == 'width':
        held = collections.Counter(row['window'] for row in found)
        found = [row for row in found if row['window'] == held.most_common(1)[0][0]]
        points = sorted((row['width'] * row['height'], row['ms'] * row['window'])
                        for row in found)
        return points, exponent(points)
    held = collections.Counter((row['width'], row['height']) for row in found)
    points = sorted((row['window'], row['ms'] * row['window']) for row in found
                    if (row['width'], row['height']) == held.most_common(1)[0][0])
    return points, exponent([point for point in points if point[0] >= line.first_window])


def error(row):
    return max(row['lambda_error'], row['background_error'])


def predicted(solver, condition):
    return condition ** (2 if solver == 'gram' else 1) * EPSILON


def families(rows):
    return list(dict.fromkeys(row['scenes'] for row in rows
                              if row['part'] == 'error' and row['scenes'].startswith('family: ')))


def problem_condition(rows, family):
    """Of the family: the largest condition number of the problem over that of X."""
    return max(row['sensitivity'] / row['condition']
               for row in chosen(rows, part='error', scenes=family))


def prediction(rows, family, solver, expected):
    """Least and largest median over seeds of error over expected(row), windows, those within the
    room, and those where the solver kept fewer singular values; None: there is no such row."""
    by_size, within, dropped, count = collections.defaultdict(list), 0, 0, 0
    for row in chosen(rows, part='error', scenes=family, solver=solver):
        count += 1
        if row['dropped'] > 0:
            dropped += 1
            continue
        ratio = error(row) / expected(row)
        within += 1 / WITHIN <= ratio <= WITHIN
        by_size[row['name'].partition(';')[0]].append(ratio)
    medians = [statistics.median(ratios) for ratios in by_size.values()]
    return (min(medians), max(medians), count, within, dropped) if medians else None


def error_checks(rows):
    found = []
    for family in families(rows):
        problem = problem_condition(rows, family)
        laws = [(solver, 'condition^2 eps' if solver == 'gram' else 'condition eps',
                 lambda row, solver=solver: predicted(solver, row['condition']))
                for solver in ('gram', 'gram-extended', 'qr')]
        if problem > WITHIN:
            laws += [(solver, 'eps times the problem\'s own condition',
                      lambda row: row['sensitivity'] * EPSILON)
                     for solver in ('gram-extended', 'qr')]
        for solver, law, expected in laws:
            ratios = prediction(rows, family, solver, expected)
            if ratios is None:
                continue
            low, high, count, within, dropped = ratios
            found.append((f'error of `{solver}` over {law}, {family}, whose problem has up to '
                          f'{problem:.2g} times the condition of X',
                          f'medians of seeds {low:.2g} to {high:.2g} ({within} of {count} windows '
                          'in the room' +
                          (f', {dropped} with fewer singular values)' if dropped else ')'),
                          f'1/{WITHIN} to {WITHIN}',
                          'no' if high > WITHIN else 'no: better' if low < 1 / WITHIN else 'yes'))
    return found


def budgets(rows):
    """[(scene, mode, under load, [rows by budget, the one without limit last])]"""
    groups = collections.defaultdict(list)
    for row in chosen(rows, part='budget'):
        mode, _, load = row['scenes'].partition('; ')
        groups[(row['name'].partition(';')[0], mode, bool(load))].append(row)
    return [(*key, sorted(found, key=lambda row: row['budget_ms'] or math.inf))
            for key, found in groups.items()]


def budget_checks(rows):
    found = []
    for scene, mode, loaded, of_budget in budgets(rows):
        limited = [row for row in of_budget if row['budget_ms'] > 0]
        for row in limited:
            # Under load, two windows are left for it to be noticed.
            mean = row['after_ms'] if loaded else row['ms']
            budget = row['budget_ms']
            found.append((f'`time-budget={budget:.0f}`, {mode}, {scene}' +
                          (', from the third window under load on' if loaded else ''),
                          f'{mean:.2f} ms a frame', f'at most {OVER_BUDGET * budget:.1f}',
                          'yes' if mean <= OVER_BUDGET * budget else 'no'))
        if not loaded:
            ages = [row['age'] for row in limited]
            found.append((f'a larger budget is no worse, {mode}, {scene}',
                          'AGE ' + ', '.join(f'{age:.2f}' for age in ages), 'falling',
                          'yes' if all(b <= a + 0.01 for a, b in zip(ages, ages[1:])) else 'no'))
    return found


def checks(rows):
    """[(what, measured, promised, yes, no or no: better)]"""
    found = []
    for line, along, promised, room in PROMISED:
        points, slope = growth(rows, line, along)
        if slope is None:
            continue
        first = line.first_window if along == 'window' else points[0][0]
        found.append((f'exponent of time: {line.title}, {GROWS[along]} {first:.0f} to '
                      f'{points[-1][0]:.0f}', f'{slope:.2f}', f'{promised} +- {room}',
                      'yes' if abs(slope - promised) <= room else 'no'))
    return found + error_checks(rows) + budget_checks(rows)
