"""What accuracy-cost wrote: rows, their averages, fits, and what was promised of them."""
import collections
import csv
import math
import statistics

EPSILON = 2.0 ** -52
NUMBERS = ('rank', 'step', 'window', 'iterations', 'width', 'height', 'turns', 'ms', 'ms_low',
           'ms_high', 'clock_ms', 'layout_mb', 'peak_mb', 'age', 'age_worst', 'psnr', 'cqm',
           'moved', 'condition', 'movement', 'sensitivity', 'lambda_error', 'background_error',
           'rank_found', 'dropped')
# Of a prediction, in both directions.
WITHIN = 100
# Name of the scaling part, column that grows, what it is, least value of the fit, exponent, room.
PROMISED = (('Gram', 'width', 'time of the Gram matrix in pixels', 0, 1.0, 0.1),
            ('Gram', 'window', 'time of the Gram matrix in the window', 100, 2.0, 0.2),
            ('solve', 'window', 'time of the small problem (full rank) in the window', 200, 3.0,
             0.4))

Setting = collections.namedtuple('Setting', 'method solver rank step window iterations')
PEERS = ('median', 'mean', 'mog2', 'knn', 'segmentation')
DEFAULT = Setting('robust', 'gram', 0, 0, 100, 1)
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


def growth(rows, name, along, least=0, **wanted):
    """[(pixels or frames, milliseconds for a window)] of a scaling part."""
    found = chosen(rows, part='scaling', name=name, **wanted)
    sizes = collections.Counter((row['width'], row['height']) for row in found)
    windows = collections.Counter(row['window'] for row in found)
    points = []
    for row in found:
        if along == 'width' and row['window'] != windows.most_common(1)[0][0]:
            continue
        if along == 'window' and (row['width'], row['height']) != sizes.most_common(1)[0][0]:
            continue
        x = row['width'] * row['height'] if along == 'width' else row['window']
        if x >= least:
            points.append((x, row['ms'] * row['window']))
    return sorted(points)


def error(row):
    return max(row['lambda_error'], row['background_error'])


def predicted(solver, condition):
    return condition ** (2 if solver == 'gram' else 1) * EPSILON


def families(rows):
    return list(dict.fromkeys(row['scenes'] for row in rows
                              if row['part'] == 'error' and ' pictures' in row['scenes']))


def predictions(rows):
    """For each family and solver: least and largest median over seeds of error over prediction,
    windows, those within the room, and those where a solver kept fewer singular values."""
    result = {}
    for family in families(rows):
        for solver in ('gram', 'gram-extended', 'qr'):
            by_size, within, dropped, count = collections.defaultdict(list), 0, 0, 0
            for row in chosen(rows, part='error', scenes=family, solver=solver):
                count += 1
                if row['dropped'] > 0:
                    dropped += 1
                    continue
                ratio = error(row) / predicted(solver, row['condition'])
                within += 1 / WITHIN <= ratio <= WITHIN
                by_size[row['name'].partition(';')[0]].append(ratio)
            medians = [statistics.median(ratios) for ratios in by_size.values()]
            if medians:
                result[(family, solver)] = (min(medians), max(medians), count, within, dropped)
    return result


def checks(rows):
    """[(what, measured, promised, yes, no or no: better)]"""
    found = []
    for name, along, what, least, promised, room in PROMISED:
        points = growth(rows, name, along, least, solver='gram', rank=0)
        slope = exponent(points)
        if slope is not None:
            found.append((f'{what}, {points[0][0]:.0f} to {points[-1][0]:.0f}', f'{slope:.2f}',
                          f'{promised} +- {room}',
                          'yes' if abs(slope - promised) <= room else 'no'))
    for (family, solver), (low, high, count, within, dropped) in predictions(rows).items():
        law = 'condition^2 eps' if solver == 'gram' else 'condition eps'
        found.append((f'error of `{solver}` over {law}, {family}: medians of seeds',
                      f'{low:.2g} to {high:.2g} ({within} of {count} windows in the room'
                      + (f', {dropped} with fewer singular values)' if dropped else ')'),
                      f'1/{WITHIN} to {WITHIN}',
                      'no' if high > WITHIN else 'no: better' if low < 1 / WITHIN else 'yes'))
    return found
