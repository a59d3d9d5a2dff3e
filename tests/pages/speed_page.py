# SPDX-License-Identifier: LGPL-2.1-or-later
"""Times whole pipelines, in turns, and puts milliseconds a frame less identity into a page.

usage: speed_page.py PAGE VIDEO FOLDER LIVE
VIDEO may be empty: a simulated scene takes its place. LIVE is the benchmark tests/bench/live, which tells what each
frame of mode=live takes.
"""
import os
import statistics
import subprocess
import sys
import time

import page

TURNS = 5
SIZES = ((320, 240, 700), (768, 576, 400), (1920, 1080, 150))
BYTES = {'RGBA': 4, 'I420': 1.5, 'NV12': 1.5, 'P010_10LE': 3}
MASK = 'qdmdbackground output=mask'
LIVE = f'{MASK} mode=live'
QDMD = f'{MASK} method=qdmd'
CONVERTED = 'videoconvert ! video/x-raw,format=RGBA ! '
# name: format, elements. The time of a format's identity is taken off its other rows.
CASES = {
    'identity': ('RGBA', 'identity'),
    'segmentation': ('RGBA', 'segmentation method=mog2 test-mode=true'),
    'default': ('RGBA', 'qdmdbackground'),
    'default, `output=mask`': ('RGBA', MASK),
    '`stabilize=off output=mask`': ('RGBA', f'{MASK} stabilize=off'),
    '`mode=live output=mask`': ('RGBA', LIVE),
    '`method=qdmd output=mask`': ('RGBA', QDMD),
    'I420 identity': ('I420', 'identity'),
    'I420': ('I420', MASK),
    'I420, videoconvert to RGBA before': ('I420', CONVERTED + MASK),
    'I420, live': ('I420', LIVE),
    'I420, live, videoconvert to RGBA before': ('I420', CONVERTED + LIVE),
    'NV12 identity': ('NV12', 'identity'),
    'NV12': ('NV12', MASK),
    'NV12, videoconvert to RGBA before': ('NV12', CONVERTED + MASK),
    'NV12, live': ('NV12', LIVE),
    'NV12, live, videoconvert to RGBA before': ('NV12', CONVERTED + LIVE),
    'NV12, `method=qdmd`': ('NV12', QDMD),
    'P010_10LE identity': ('P010_10LE', 'identity'),
    'P010_10LE': ('P010_10LE', MASK),
    'P010_10LE, live': ('P010_10LE', LIVE),
    'P010_10LE, `method=qdmd`': ('P010_10LE', QDMD),
}


def beside(name):
    """What a row of formats is compared with: the same without a conversion, in 8 bits, or in RGBA."""
    form, elements = CASES[name]
    if elements.startswith(CONVERTED):
        other = form, elements.removeprefix(CONVERTED)
    else:
        other = 'NV12' if form == 'P010_10LE' else 'RGBA', elements
    return next(row for row, case in CASES.items() if case == other)


def launch(pipeline):
    start = time.perf_counter()
    subprocess.run(['gst-launch-1.0', '-q', *pipeline.split()], check=True)
    return time.perf_counter() - start


def raw(video, folder, form, width, height, frames):
    path = f'{folder}/{width}x{height}.{form}'
    source = f'filesrc location={video} ! decodebin' if video else 'qdmdscenesrc scene=basic'
    if not os.path.exists(path):
        launch(f'{source} ! videoconvert ! videoscale ! '
               f'video/x-raw,format={form},width={width},height={height} ! '
               f'identity eos-after={frames} ! filesink location={path}')
    return path


def milliseconds(video, folder, width, height, frames):
    """{case: what it takes a frame, beyond identity}"""
    seconds = {name: [] for name in CASES}
    for turn in range(TURNS):
        print(f'\r{width}x{height}: turn {turn + 1} of {TURNS} ', end='', file=sys.stderr)
        for name, (form, elements) in CASES.items():
            size = int(width * height * BYTES[form])
            path = raw(video, folder, form, width, height, frames)
            source = (f'filesrc location={path} blocksize={size} ! rawvideoparse '
                      f'format={form.lower().replace("_", "-")} width={width} height={height} framerate=25/1')
            seconds[name].append(launch(f'{source} ! {elements} ! fakesink sync=false')
                                 * 1000 * size / os.path.getsize(path))
    median = {name: statistics.median(values) for name, values in seconds.items()}
    of_format = {form: name for name, (form, elements) in CASES.items() if elements == 'identity'}
    return {name: median[name] - median[of_format[form]]
            for name, (form, elements) in CASES.items() if elements != 'identity'}


RUNS = 5


def evenness(live, folder, width, height):
    """The median frame of mode=live in ms, and how many times that the longest ones take, medians of five runs: of the
    first ten, of those that fill the window, and of those after. Then the same of those after, each in its shortest run:
    what a frame takes by itself, for what other programs and the host take comes to other frames in each run."""
    times = f'{folder}/live-times.txt'
    rows, runs = [], []
    for run in range(RUNS):
        print(f'\r{width}x{height}: live, run {run + 1} of {RUNS} ', end='', file=sys.stderr)
        subprocess.run([live, '--unpaced', '--seconds', '24', '--width', str(width), '--height', str(height),
                        '--times', times], check=True, stdout=subprocess.DEVNULL)
        with open(times, encoding='ascii') as file:
            frames = [float(line) for line in file]
        median = statistics.median(frames[200:])
        rows.append((median, *(max(part) / median for part in (frames[:10], frames[10:200], frames[200:]))))
        runs.append(frames[200:])
    shortest = [min(frame) for frame in zip(*runs)]
    return [*(statistics.median(column) for column in zip(*rows)), max(shortest) / statistics.median(shortest)]


if __name__ == '__main__':
    target, clip, results, live_bench = sys.argv[1:]
    even = [[f'{w}x{h}', *(f'{value:.2f}' for value in evenness(live_bench, results, w, h))] for w, h, _ in SIZES[1:]]
    columns = [milliseconds(clip, results, *size) for size in SIZES]
    print(file=sys.stderr)
    sizes = [f'{w}x{h}' for w, h, _ in SIZES]
    rows = {name: [name] for name in columns[0]}
    for name, row in rows.items():
        to_rgba = CASES[name][0] == 'RGBA'
        for column in columns:
            ratio = (column['segmentation'] / column[name] if to_rgba else
                     column[name] / column[beside(name)])
            row.append(f'{column[name]:.2f} ({ratio:.2f})')
    page.put(target, {
        'speed': page.table(['ms a frame (times as fast as `segmentation`)', *sizes],
                            [row for name, row in rows.items() if CASES[name][0] == 'RGBA']),
        'even': page.table(['frames of `mode=live`', 'median, ms', 'longest of the first 10', 'of the next 190',
                            'of the 400 after', 'of these, each in its shortest run'], even),
        'speed-formats': page.table(['ms a frame, `output=mask` (times as long as)', *sizes],
                                    [row for name, row in rows.items() if CASES[name][0] != 'RGBA']),
    })
