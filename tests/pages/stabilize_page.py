# SPDX-License-Identifier: LGPL-2.1-or-later
"""Measures scenes in which the camera moves, and puts the results into docs/stabilize.md.

Usage: stabilize_page.py PAGE RESULTS IMAGES
"""
import json
import os
import re
import subprocess
import sys
import tempfile

import cv2
import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt
import numpy

from page import put, table

WIDTH, HEIGHT, FRAMES = 320, 240, 400
CAPS = f'video/x-raw,format=RGB,width={WIDTH},height={HEIGHT},framerate=25/1'
# Scene, and what `stabilize` is for it.
SCENES = [('basic', 'translation'), ('basic,jitter=0.5', 'translation'), ('basic,jitter=2', 'translation'),
          ('basic,jitter=5', 'translation'), ('basic,jitter=2:rotation=1', 'similarity'),
          ('basic,jitter=5:rotation=1', 'similarity'), ('basic,jitter=0:drift=1:way=14', 'translation'),
          ('camera-jitter', 'translation'), ('storm', 'translation')]


def launch(pipeline, messages=False):
    command = ['gst-launch-1.0', '-m' if messages else '-q', *pipeline.split()]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def render(scene, truth):
    with tempfile.NamedTemporaryFile() as raw:
        launch(f'qdmdscenesrc scene={scene} seed=3 truth={truth} num-buffers={FRAMES} ! {CAPS} ! '
               f'filesink location={raw.name}')
        return numpy.fromfile(raw.name, numpy.uint8).reshape(-1, HEIGHT, WIDTH, 3)


def through(frames, properties):
    with tempfile.TemporaryDirectory() as folder:
        frames.tofile(f'{folder}/in')
        launch(f'filesrc location={folder}/in blocksize={WIDTH * HEIGHT * 3} ! rawvideoparse format=rgb '
               f'width={WIDTH} height={HEIGHT} framerate=25/1 ! qdmdbackground {properties} ! '
               f'filesink location={folder}/out')
        return numpy.fromfile(f'{folder}/out', numpy.uint8).reshape(-1, HEIGHT, WIDTH, 3)


def grey(picture):
    return picture.astype(numpy.float32) @ numpy.array([.299, .587, .114], numpy.float32)


def f_of(masks, truth):
    start = len(truth) // 4
    hit = (masks[start:] & truth[start:]).sum()
    return 2 * hit / max(1, masks[start:].sum() + truth[start:].sum())


def age_of(pictures, truth):
    return numpy.mean([numpy.abs(grey(pictures[t]) - grey(truth[t])).mean() for t in range(0, len(truth), 5)])


def peer(model, frames):
    masks, backgrounds = [], {}
    for t, frame in enumerate(frames):
        masks.append(model.apply(frame[..., ::-1]) == 255)
        if t % 5 == 0:
            backgrounds[t] = model.getBackgroundImage()[..., ::-1]
    return numpy.array(masks), backgrounds


def poses(scene, stabilize):
    """Truth and finding of each frame that moved: rows of x, y, angle."""
    text = launch(f'qdmdscenesrc post-messages=true scene={scene} seed=3 num-buffers={FRAMES} ! {CAPS} ! '
                  f'qdmdbackground post-messages=true stabilize={stabilize} ! fakesink', messages=True)
    seen = {'qdmdscenesrc': {}, 'qdmdbackground': {}}
    for name, fields in re.findall(r'(qdmdscenesrc|qdmdbackground)-camera, (.*);', text):
        values = dict(re.findall(r'([a-z-]+)=\([a-z0-9]+\)([^,;]+)', fields))
        seen[name][int(values['timestamp'])] = [float(values[f'camera-{part}']) for part in ('x', 'y', 'angle')]
    times = sorted(set(seen['qdmdbackground']) & set(seen['qdmdscenesrc']))
    return (numpy.array([time / 1e9 for time in times]), numpy.array([seen['qdmdscenesrc'][t] for t in times]),
            numpy.array([seen['qdmdbackground'][t] for t in times]))


def measure_scene(scene, stabilize):
    frames, truth = render(scene, 'none'), render(scene, 'background')
    mask = render(scene, 'mask')[..., 0] > 127
    row = [f'`{scene}`']
    for mode in 'batch', 'live':
        for setting in stabilize, 'off':
            common = f'mode={mode} stabilize={setting}'
            age = age_of(through(frames, f'{common} output=background'), truth)
            f = f_of(through(frames, f'{common} output=mask')[..., 0] > 127, mask)
            row.append(f'{age:.2f}, {f:.3f}')
    for model in cv2.createBackgroundSubtractorMOG2(), cv2.createBackgroundSubtractorKNN():
        masks, backgrounds = peer(model, frames)
        age = numpy.mean([numpy.abs(grey(backgrounds[t]) - grey(truth[t])).mean() for t in backgrounds])
        row.append(f'{age:.2f}, {f_of(masks, mask):.3f}')
    return row


def measure_motion(scene, stabilize):
    _, truth, found = poses(scene, stabilize)
    if len(truth) == 0:
        return None
    error = found - truth
    # The canvas is somewhere.
    error -= numpy.median(error, 0)
    way = numpy.sort(numpy.hypot(error[:, 0], error[:, 1]))
    angle = numpy.sort(numpy.abs(error[:, 2]))
    at = int(0.95 * len(way))
    return [f'`{scene}`', str(len(way)), f'{numpy.median(way):.3f}', f'{way[at]:.3f}', f'{numpy.mean(way < 0.1):.3f}',
            f'{angle[at]:.3f}' if stabilize == 'similarity' else '']


def plot(path):
    times, truth, found = poses('basic,jitter=2:rotation=0.5:drift=0.4', 'similarity')
    drawing, axes = plt.subplots(3, 1, figsize=(10, 6), layout='constrained', sharex=True)
    for i, (axis, title) in enumerate(zip(axes, ('camera-x, pixels', 'camera-y, pixels', 'camera-angle, degrees'))):
        shift = numpy.median(found[:, i] - truth[:, i])
        axis.plot(times, truth[:, i] + shift, color='#999999', linewidth=3, label="the simulator's truth")
        axis.plot(times, found[:, i], color='#D55E00', linewidth=0.8, label='found')
        axis.set_ylabel(title)
        axis.grid(True, alpha=0.3)
    axes[0].legend(fontsize=7)
    axes[2].set_xlabel('seconds')
    drawing.savefig(path, metadata={'Date': None})
    plt.close(drawing)


def picture(path):
    frames = render('camera-jitter', 'none')
    rows = []
    for setting in 'off', 'translation':
        row = [frames[200]]
        for output in 'background', 'mask':
            row.append(through(frames, f'stabilize={setting} output={output}')[200])
        rows.append(numpy.hstack(row))
    cv2.imwrite(path, numpy.vstack(rows)[..., ::-1])


def cost(path):
    with open(path) as file:
        runs = json.load(file)['benchmarks']
    medians = {run['run_name']: run['cpu_time'] for run in runs if run['aggregate_name'] == 'median'}
    titles = {'find/still': 'motion of a still camera', 'find/still_crowd': 'the same before a crowd',
              'find/shaking': 'of a camera that shakes', 'find/turning': 'of one that turns, too',
              'take_reference': 'a new background to compare with, every 50 frames at most',
              'move/shift': 'a plane moved (seven of them at most)', 'move/turn': 'a plane turned',
              'opencv/warpAffine': "OpenCV's warpAffine, bicubic, a plane shifted",
              'opencv/phaseCorrelate': "OpenCV's phaseCorrelate at 320 pixels",
              'opencv/ecc_translation': "OpenCV's findTransformECC at 320 pixels, translation",
              'opencv/ecc_euclidean': 'the same, with rotation'}
    sizes = list(dict.fromkeys(name.split('/')[-1] for name in medians))
    rows = [[title] + [f'{medians[f"{name}/{size}"]:.0f}' for size in sizes] for name, title in titles.items()]
    return table(['microseconds'] + sizes, rows)


def main(page, results, images):
    scenes = table(['scene', 'batch', 'batch, off', 'live', 'live, off', 'MOG2', 'KNN'],
                   [measure_scene(*scene) for scene in SCENES])
    rows = [measure_motion(*scene) for scene in SCENES]
    motion = table(['scene', 'frames that moved', 'median error, pixels', '95 %', 'share below 0.1',
                    'angle, 95 %, degrees'], [row for row in rows if row])
    put(page, {'scenes': scenes, 'motion': motion, 'cost': cost(os.path.join(results, 'cost.json'))})
    plot(os.path.join(images, 'motion.svg'))
    picture(os.path.join(results, 'shaken.png'))


if __name__ == '__main__':
    main(*sys.argv[1:])
