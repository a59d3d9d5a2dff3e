# SPDX-License-Identifier: LGPL-2.1-or-later
"""Times qdmd-archive with one process and two, compares masks of parts with those of one piece, and
puts both and a model of many machines into a page.

usage: archive_page.py PAGE VIDEO FOLDER

VIDEO may be empty: a simulated scene takes its place. QDMD_DATA: sequences whose masks are compared
"""
import json
import os
import pathlib
import statistics
import subprocess
import sys
import time

import gi
import numpy as np

import page

gi.require_version('Gst', '1.0')
gi.require_version('GstApp', '1.0')
from gi.repository import Gst, GstApp  # noqa: F401  (methods of appsink)

ARCHIVE = 'build/examples/archive/qdmd-archive'
WIDTH, HEIGHT, FILM = 1920, 1080, 600
# The film so many times: four minutes of 25 frames a second.
TIMES = int(os.environ.get('QDMD_ARCHIVE_TIMES', 10))
TURNS = int(os.environ.get('QDMD_ARCHIVE_TURNS', 5))
WINDOW = 100
# As qdmd-archive chooses them, of long recordings.
WARM_UP = 500
STRETCH = 15 * WARM_UP
PARTS = (2, 3, 4, 8)
# name: recording below QDMD_DATA, frames a second.
SEQUENCES = {'vtest': ('videos/vtest.avi', 10), 'HighwayII': ('SBI/HighwayII/input', 25),
             'office': ('CDnet/office/input', 25)}
# Simulated, with things that stop, stand and leave; longer than what is recorded.
SCENE, SCENE_FRAMES = 'intermittent-motion', 3200
MACHINES = (1, 2, 4, 8, 16, 32, 64)
HOURS = 24


def launch(pipeline, core):
    start = time.perf_counter()
    subprocess.run(['taskset', '-c', str(core), 'gst-launch-1.0', '-q', *pipeline.split()], check=True)
    return time.perf_counter() - start


def clip(video, folder):
    path = f'{folder}/film.mkv'
    source = f'filesrc location={video} ! decodebin' if video else 'qdmdscenesrc scene=basic'
    if not os.path.exists(path):
        launch(f'{source} ! videoconvert ! videoscale ! '
               f'video/x-raw,format=I420,width={WIDTH},height={HEIGHT} ! identity eos-after={FILM} ! '
               f'x264enc speed-preset=veryfast ! h264parse ! matroskamux ! filesink location={path}',
               '0,1')
    return path


def run(folder, recordings, *words, cores='0,1'):
    """Its report, with the seconds that all of it took."""
    report = f'{folder}/report.json'
    start = time.perf_counter()
    subprocess.run(['taskset', '-c', cores, ARCHIVE, *recordings, *map(str, words), '--report',
                    report, '--quiet'], check=True)
    return json.loads(pathlib.Path(report).read_text()) | {'wall': time.perf_counter() - start}


def two_against_one(folder, film):
    words = ['--background', f'{folder}/b.png', '--mask', f'{folder}/m.mkv', '--n-threads', 1,
             '--window', WINDOW]
    return [(run(folder, [film] * TIMES, *words, '--stretch', 10**9, cores='0'),
             run(folder, [film] * TIMES, *words, '--jobs', 2)) for _ in range(TURNS)]


def processor(report, of=sum):
    return of(stretch['processor-seconds'] for stretch in report['stretches'])


def median(values):
    return statistics.median(values)


def speed_table(pairs):
    wall = [one['wall'] / two['wall'] for one, two in pairs]
    # Without what other programs take: joining is in both.
    work = [(processor(one) + one['seconds-joining']) / (processor(two, max) + two['seconds-joining'])
            for one, two in pairs]
    frames = pairs[0][0]['frames']
    rows = [[f'{1000 * median(one["wall"] for one, _ in pairs) / frames:.1f}',
             f'{1000 * median(two["wall"] for _, two in pairs) / frames:.1f}',
             f'{median(wall):.2f}', f'{min(wall):.2f}, {max(wall):.2f}', f'{median(work):.2f}']]
    return page.table([f'ms a frame of {frames}, one process', 'two processes', 'times as fast',
                       'from, to', 'by processor time, of the one that works most'], rows)


def masks_of(path):
    pipeline = Gst.parse_launch(f'filesrc location="{path}" ! decodebin ! videoconvert ! '
                                'video/x-raw,format=GRAY8 ! appsink name=end sync=false')
    pipeline.set_state(Gst.State.PLAYING)
    masks = []
    while sample := pipeline.get_by_name('end').try_pull_sample(30 * Gst.SECOND):
        width = sample.get_caps().get_structure(0).get_int('width')[1]
        data = sample.get_buffer().extract_dup(0, sample.get_buffer().get_size())
        rows = np.frombuffer(data, np.uint8).reshape(-1, (width + 3) // 4 * 4)
        masks.append(np.packbits(rows[:, :width] > 127))
    pipeline.set_state(Gst.State.NULL)
    return masks


def agreement(one, other, frames):
    """F of the masks of these frames."""
    count = lambda bits: int(np.unpackbits(bits).sum())
    both = sum(count(one[t] & other[t]) for t in frames)
    differ = sum(count(one[t] ^ other[t]) for t in frames)
    return 2 * both / max(2 * both + differ, 1)


def sequences(folder):
    """Name, file and frames a second."""
    for name, (recording, rate) in SEQUENCES.items():
        path = pathlib.Path(os.environ.get('QDMD_DATA', ''), recording)
        if path.exists():
            yield name, path, rate
    path = pathlib.Path(folder, SCENE + '.mkv')
    launch(f'qdmdscenesrc scene={SCENE} seed=3 num-buffers={SCENE_FRAMES} ! '
           'video/x-raw,width=320,height=240 ! videoconvert ! video/x-raw,format=I420 ! avenc_ffv1 ! '
           f'matroskamux ! filesink location={path}', '0,1')
    yield SCENE, path, 25


def agreement_table(folder):
    rows = []
    for name, path, rate in sequences(folder):
        words = ['--mask', f'{folder}/a.mkv', '--window', WINDOW, '--framerate', rate]
        run(folder, [path], *words, '--stretch', 10**9)
        whole = masks_of(f'{folder}/a.mkv')
        sizes = {-(-len(whole) // parts // WINDOW) * WINDOW for parts in PARTS}
        for size in sorted(sizes - {-(-len(whole) // WINDOW) * WINDOW}, reverse=True):
            run(folder, [path], *words, '--stretch', size)
            masks = masks_of(f'{folder}/a.mkv')
            first = {t for t in range(size, len(whole)) if t % size < rate}
            rest = set(range(len(whole))) - first
            rows.append([name, str(-(-len(whole) // size)), str(size),
                         f'{agreement(whole, masks, rest):.4f}',
                         f'{agreement(whole, masks, first):.4f}'])
    return page.table(['sequence', 'parts', 'frames of each', 'F outside of the first second',
                       'F in it'], rows)


def model_table(pairs, decode):
    """Hours of a long recording, of machines with one core each."""
    one = pairs[0][0]
    first, second = ([b['stretches'][i] for _, b in pairs] for i in (0, 1))
    work = median(s['processor-seconds'] / s['frames'] for s in first)
    warm = median((s['processor-seconds'] - work * s['frames']) / s['warm-up'] for s in second)
    joining = median(a['seconds-joining'] for a, _ in pairs) / one['frames']
    frames = HOURS * 3600 * 25
    rows = []
    for machines in MACHINES:
        turns = -(-frames // STRETCH // machines)
        worked = turns * (STRETCH * work + WARM_UP * warm) if machines > 1 else frames * work
        joined = joining * frames
        rows.append([str(machines), f'{worked / 3600:.2f}', f'{joined / 3600:.2f}',
                     f'{(worked + joined) / 3600:.2f}',
                     f'{(frames * work + joined) / (worked + joined):.1f}'])
    text = (f'A frame takes {1000 * work:.1f} ms of one core, {1000 * decode:.1f} ms of them to decode '
            f'it; one to warm up {1000 * warm:.1f} ms; joining takes {1000 * joining:.2f} ms.')
    return text + '\n\n' + page.table(
        ['machines', f'h of work, {HOURS} h of 1920x1080', 'h of joining', 'h in all',
         'times as fast'], rows)


def main():
    target, video, folder = sys.argv[1:4]
    Gst.init(None)
    film = clip(video, folder)
    pairs = two_against_one(folder, film)
    decode = min(launch(f'filesrc location={film} ! decodebin ! fakesink sync=false', 0)
                 for _ in range(3)) / FILM
    pathlib.Path(folder, 'load-after').write_text(subprocess.check_output(['uptime'], text=True))
    page.put(target, {
        'speed': speed_table(pairs),
        'agreement': agreement_table(folder),
        'model': model_table(pairs, decode),
        'machine': page.machine(folder),
    })


if __name__ == '__main__':
    main()
