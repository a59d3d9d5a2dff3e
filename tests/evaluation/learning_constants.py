#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Markdown table: what other values of the constants of learning_steps.h would give.

Usage: learning_constants.py [--long] [--factors 0.7,1.4] [--only NAME...] [--jobs N] [--folder FOLDER]

Builds the plugin with -Dlearning-steps=adjustable in FOLDER (build-steps), and multiplies one
constant at a time; integers are rounded, and changed by at least 1. Figures are of simulated streams:
  AGE     of backgrounds, luma 16 to 235, mean of every fifth frame; with QDMD_DATA in the
          environment, of the recorded sequences there, too
  kept    people who come and stand: half of their pixels are white in 95 of 100 frames;
          these, empty and gone are of both modes together
  empty   of the same, those whose place the last background shows without them
  gone    people who stood there and left: a tenth of their place, at most, is white in 95 of 100
          frames, from 15 frames after they left on
  wrong   frames after disturbances of half a second whose masks are wrong in 1 % more of the picture
          than without them
A dash says that all pictures are bit for bit what they are without the change. The short form takes
some minutes and tells what has an effect; --long has larger pictures, and more scenes and
seeds, and takes an hour or two.
Needs Debian's python3-numpy, with QDMD_DATA python3-opencv, and build/gst/libgstqdmdscene.so.
"""
import argparse
import collections
import concurrent.futures
import glob
import hashlib
import os
import re
import subprocess
import sys
import tempfile

import numpy as np

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), '../..'))
FILES = ['core/learn/robust/learning_steps.h', 'core/passes/patch_density.h', 'core/passes/mask.h']
SCENES = ROOT + '/build/gst/libgstqdmdscene.so'
RATE = 25
COME = 200  # frames before people come, leave, and disturbances begin
Figures = collections.namedtuple('Figures', 'age kept empty gone wrong digest')


def read(path):
    with open(os.path.join(ROOT, path), encoding='utf-8') as file:
        return file.read()


def steps():
    """[(name, value)]: integers are int."""
    along = re.search(r'kCellsAlong = (\d+)', read('core/passes/grid.h')).group(1)
    found = []
    for path in FILES:
        # Comments have an example.
        text = re.sub(r'//.*', '', read(path))
        for name, value in re.findall(r'\bstep\("([^"]+)",\s*([^;]*?)\)', text):
            value = re.sub(r'[\w:]+\{(.*)\}', r'\1', value.replace('kCellsAlong', along))
            parts = [part.strip() for part in value.split('/')]
            number = float(parts[0].rstrip('f')) / (float(parts[1].rstrip('f')) if parts[1:] else 1)
            found.append((name, number if '.' in value else int(number)))
    return found


def scaled(value, factor):
    if isinstance(value, float):
        return value * factor
    moved = round(value * factor)
    return moved if moved != value else value + (1 if factor > 1 else -1)


def launch(pipeline, plugin, constants=''):
    environment = {**os.environ, 'GST_PLUGIN_PATH_1_0': plugin, 'QDMD_STEPS': constants,
                   'GST_REGISTRY_1_0': os.path.join(plugin, 'constants-registry.bin')}
    done = subprocess.run(['gst-launch-1.0', '-q', f'--gst-plugin-load={SCENES}', *pipeline.split()],
                          capture_output=True, text=True, env=environment, check=False)
    # What gst-launch-1.0 says of a plugin that is refused ends with 0.
    if done.returncode or done.stderr:
        raise RuntimeError(f'{pipeline}\n{constants}\n{done.stderr[:500]}')


class Clip:
    """Frames of a simulated scene, kept in a file, and their truth."""

    def __init__(self, folder, plugin, scene, seed, count, size):
        self.size, self.count = size, count
        width, height = size

        def render(truth):
            path = os.path.join(folder, f'{scene}-{seed}-{truth}.raw')
            launch(f'qdmdscenesrc scene={scene} seed={seed} truth={truth} num-buffers={count} ! '
                   f'video/x-raw,format=RGB,width={width},height={height},framerate={RATE}/1 ! '
                   f'filesink location={path}', plugin)
            return path

        self.frames = render('none')
        self.mask = self.load(render('mask'))[..., 0] > 127
        self.background = self.load(render('background'))

    def load(self, path):
        width, height = self.size
        return np.fromfile(path, np.uint8).reshape(-1, height, width, 3)


class Recorded:
    """Frames of a recorded sequence, and its background."""

    def __init__(self, folder, sequence):
        import cv2
        frames = np.array([cv2.imread(name)[..., ::-1]
                           for name in sorted(glob.glob(sequence + '/input/*'))])
        truth = cv2.imread(glob.glob(sequence + '/gt/*_*.*')[0])[..., ::-1]
        # Rows of raw RGB video are multiples of 4 bytes.
        frames, truth = (of[..., :truth.shape[1] // 4 * 4, :] for of in (frames, truth))
        self.size, self.count = (truth.shape[1], truth.shape[0]), len(frames)
        self.background = np.broadcast_to(truth, frames.shape)
        self.frames = os.path.join(folder, os.path.basename(sequence) + '.raw')
        np.ascontiguousarray(frames).tofile(self.frames)

    load = Clip.load


def regions(inside, least):
    """Masks of connected parts of at least so many pixels."""
    labels = np.where(inside, np.arange(1, inside.size + 1).reshape(inside.shape), 0)
    while True:
        wide = np.pad(labels, 1)
        most = np.maximum.reduce([labels, wide[2:, 1:-1], wide[:-2, 1:-1], wide[1:-1, 2:],
                                  wide[1:-1, :-2]])
        most[~inside] = 0
        if (most == labels).all():
            break
        labels = most
    names, counts = np.unique(labels[inside], return_counts=True)
    return [labels == name for name, count in zip(names, counts) if count >= least]


def luma(picture):
    return np.round(16 + picture @ np.array([65.481, 128.553, 24.966]) / 255)


class Measure:
    def __init__(self, folder, plugin, is_long):
        self.folder, self.plugin = folder, plugin
        size, seeds = ((320, 240), [3, 4]) if is_long else ((160, 120), [3])
        at = COME / RATE

        def clips(scene):
            return [Clip(folder, plugin, scene, seed, COME + (200 if is_long else 120), size)
                    for seed in seeds]

        self.standers = clips(f'basic,noise=8,shadow,stand=10:from={at}')
        self.leavers = clips(f'storm,leave=8:at={at}')
        kinds, scenes = ['smear'], ['basic,clutter,light-switch']
        if is_long:
            kinds += ['lost-signal', 'focus-search', 'lost-blocks']
            scenes += ['basic,bootstrap', 'illumination-changes', 'dynamic-background', 'night']
        self.backgrounds = [clip for scene in scenes for clip in clips(scene)]
        self.undisturbed = clips('basic')
        self.disturbed = [clips(f'basic,{kind}:from={at}:seconds=0.5') for kind in kinds]
        if os.environ.get('QDMD_DATA'):
            self.backgrounds += [
                Recorded(folder, os.path.dirname(path))
                for path in sorted(glob.glob(os.environ['QDMD_DATA'] + '/*/*/input'))
                if glob.glob(os.path.dirname(path) + '/gt/*_*.*')]

    def through(self, clip, constants, settings, digest):
        width, height = clip.size
        with tempfile.NamedTemporaryFile(dir=self.folder) as out:
            # One thread: pictures do not depend on how threads meet.
            launch(f'filesrc location={clip.frames} blocksize={width * height * 3} ! '
                   f'rawvideoparse format=rgb width={width} height={height} framerate={RATE}/1 ! '
                   f'qdmdbackground n-threads=1 {settings} ! video/x-raw,format=RGB ! '
                   f'filesink location={out.name}', self.plugin, constants)
            pictures = clip.load(out.name)
        digest.update(pictures)
        return pictures

    def figures(self, constants):
        digest = hashlib.md5()
        ages, kept, empty, gone, wrong = [], 0, 0, 0, 0
        for mode in ('batch', 'live'):
            def masks(clip):
                return self.through(clip, constants, f'mode={mode} output=mask', digest)[..., 0] > 127

            def backgrounds(clip):
                pictures = self.through(clip, constants, f'mode={mode} output=background', digest)
                ages.append(np.mean([np.abs(luma(pictures[t]) - luma(clip.background[t])).mean()
                                     for t in range(0, clip.count, 5)]))
                return pictures

            for clip in self.backgrounds:
                backgrounds(clip)
            for clip in self.standers:
                white, last = masks(clip), backgrounds(clip)[-1].astype(float)
                stood = slice(COME + RATE, None)
                for person in regions(clip.mask[stood].mean(0) > 0.95, clip.size[1] // 4):
                    kept += (white[stood][:, person].mean(1) >= 0.5).mean() >= 0.95
                    empty += np.abs(last - clip.background[-1])[person].mean() < 12
            for clip in self.leavers:
                white = masks(clip)
                moved = np.abs(clip.background[0].astype(float) - clip.background[-1]).mean(-1)
                for place in regions(moved > 8, clip.size[1] // 4):
                    quiet = [t for t in range(COME + 15, clip.count)
                             if clip.mask[t][place].mean() <= 0.1]
                    gone += np.mean([white[t][place].mean() <= 0.1 for t in quiet]) >= 0.95
            after = COME + RATE // 2 + 1
            for i, clip in enumerate(self.undisturbed):
                allowed = (masks(clip) != clip.mask).mean((1, 2)) + 0.01
                for kind in self.disturbed:
                    off = (masks(kind[i]) != clip.mask).mean((1, 2))
                    wrong += int((off > allowed)[after:].sum())
        return Figures(np.mean(ages), kept, empty, gone, wrong, digest.hexdigest())


def build(folder):
    path = os.path.join(ROOT, folder)
    again = ['--reconfigure'] if os.path.exists(path + '/build.ninja') else []
    subprocess.run(['meson', 'setup', *again, path, '-Dlearning-steps=adjustable', '-Dtests=disabled',
                    '-Dexamples=disabled', '-Dlibrary=false', '-Dscene=disabled'],
                   cwd=ROOT, check=True, stdout=sys.stderr)
    subprocess.run(['ninja', '-C', path, 'gst/libgstqdmd.so'], check=True, stdout=sys.stderr)
    return path + '/gst'


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--long', action='store_true')
    parser.add_argument('--factors', default='0.7,1.4')
    parser.add_argument('--only', nargs='*', default=[''], help='constants whose names begin so')
    parser.add_argument('--jobs', type=int, default=os.cpu_count())
    parser.add_argument('--folder', default='build-steps')
    asked = parser.parse_args()

    factors = [float(factor) for factor in asked.factors.split(',')]
    chosen = [(name, value) for name, value in steps() if name.startswith(tuple(asked.only))]

    def cells(of):
        return [f'{of.age:.2f}', f'{of.kept} {of.empty} {of.gone}', f'{of.wrong}']

    plugin = build(asked.folder)
    with tempfile.TemporaryDirectory() as folder, \
            concurrent.futures.ThreadPoolExecutor(asked.jobs) as pool:
        measure = Measure(folder, plugin, asked.long)
        as_it_is = measure.figures('')
        variants = [f'{name}={scaled(value, factor)!r}' for name, value in chosen for factor in factors]
        results = pool.map(measure.figures, variants)

        heads = [f'{figure} x {factor:g}' for factor in factors
                 for figure in ('AGE', 'kept, empty, gone', 'wrong')]
        print('| constant | value | ' + ' | '.join(heads) + ' |')
        print('|---|---|' + '---|' * len(heads))
        print('| **as it is** | | ' + ' | '.join(cells(as_it_is) * len(factors)) + ' |', flush=True)
        for i, (name, value) in enumerate(chosen):
            print(f'{i} of {len(chosen)} constants\r', end='', file=sys.stderr, flush=True)
            row = [f'{value:.3g}']
            for _ in factors:
                result = next(results)
                row += ['-'] * 3 if result.digest == as_it_is.digest else cells(result)
            print(f'| {name} | ' + ' | '.join(row) + ' |', flush=True)


if __name__ == '__main__':
    main()
