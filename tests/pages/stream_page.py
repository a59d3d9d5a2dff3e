# SPDX-License-Identifier: LGPL-2.1-or-later
"""AGE of what was seen, frame by frame: the element beside MOG2, KNN and the median of all frames so far.

usage: stream_page.py PAGE PLOT

A pixel counts from the frame on by which its background was visible in ten frames. A global gain of each
channel is taken out of a picture first: light that changes is no error. AGE is that of SBI, in levels of
luma from 16 to 235.
"""
import glob
import os
import subprocess
import sys
import tempfile

import cv2
import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt
import numpy as np
import page

SEEN, NEAR, STEP = 10, 12, 3
WINDOW = 100  # of the default
MEDIAN_FRAMES = 100
SETTINGS = {'default': '', 'mode=live': 'mode=live'}


def luma(picture):
    p = picture.astype(np.float64)
    return np.round(16 + (65.481 * p[..., 0] + 128.553 * p[..., 1] + 24.966 * p[..., 2]) / 255)


def sequences():
    for folder in sorted(glob.glob(os.environ['QDMD_DATA'] + '/*/*/input')):
        top = os.path.dirname(folder)
        truth = glob.glob(top + '/gt/GT_*') or glob.glob(top + '/gt/DERIVED_*')
        if not truth:
            continue
        frames = np.array([cv2.imread(name)[:, :, ::-1] for name in sorted(glob.glob(folder + '/*'))])
        truth = cv2.imread(truth[0])[:, :, ::-1]
        if frames.shape[1:] == truth.shape:
            yield os.path.basename(top), frames, truth


def gain(frame, truth, where):
    ratio = truth[where].astype(float) / frame[where]
    return np.array([np.median(ratio[:, c]) for c in range(3)])


def bright(frame, truth):
    return (frame.min(-1) > 8) & (truth.min(-1) > 8)


def known(frames, truth):
    """By which frame the background of each pixel was visible often enough; len(frames): never."""
    count = np.zeros(truth.shape[:2], int)
    since = np.full(truth.shape[:2], len(frames))
    for t, frame in enumerate(frames):
        g = gain(frame, truth, bright(frame, truth))
        if np.any(np.abs(np.log(g)) > 0.35):
            g = np.ones(3)
        count += cv2.blur(np.abs(frame * g - truth).mean(-1), (3, 3)) <= NEAR
        since[(count >= SEEN) & (since == len(frames))] = t
    return since


def age(picture, truth, where):
    use = bright(picture, truth) & where
    g = np.clip(gain(picture, truth, use), 0.7, 1.4) if use.sum() > 100 else np.ones(3)
    error = np.abs(luma(np.clip(picture * g, 0, 255)) - luma(truth))
    return error[where].mean() if where.any() else np.nan


def of_element(frames, setting):
    count, height, width, _ = frames.shape
    size = frames[0].size
    with tempfile.TemporaryDirectory() as folder:
        frames.tofile(folder + '/in')
        pipeline = (f'filesrc location={folder}/in blocksize={size} ! rawvideoparse format=rgb width={width} '
                    f'height={height} framerate=25/1 plane-strides=<{3 * width}> plane-offsets=<0> '
                    f'frame-size={size} ! qdmdbackground {setting} ! video/x-raw,format=RGB ! '
                    f'filesink location={folder}/out')
        subprocess.run(['gst-launch-1.0', '-q', *pipeline.split()], check=True)
        out = np.fromfile(folder + '/out', np.uint8)
    rows = out.reshape(count, height, -1)
    return rows[:, :, :3 * width].reshape(frames.shape)[::STEP]


def of_subtractor(frames, subtractor):
    for t, frame in enumerate(frames):
        subtractor.apply(frame)
        if t % STEP == 0:
            yield subtractor.getBackgroundImage()


def of_median(frames):
    for t in range(0, len(frames), STEP):
        chosen = np.unique(np.linspace(0, t, MEDIAN_FRAMES).round().astype(int))
        yield np.median(frames[chosen], axis=0).astype(np.uint8)


def pictures(frames):
    """Of each method, every STEP-th background."""
    for name, setting in SETTINGS.items():
        yield name, of_element(frames, setting)
    yield 'MOG2', of_subtractor(frames, cv2.createBackgroundSubtractorMOG2())
    yield 'KNN', of_subtractor(frames, cv2.createBackgroundSubtractorKNN())
    yield 'median so far', of_median(frames)


def measured():
    """{method: {sequence: AGE of every STEP-th frame}}"""
    ages = {}
    for name, frames, truth in sequences():
        since = known(frames, truth)
        for method, backgrounds in pictures(frames):
            print(f'\r{name:16s} {method:16s}', end='', file=sys.stderr)
            of_method = []
            for i, background in enumerate(backgrounds):
                # The default may look to the end of the frame's window.
                t = STEP * i
                last = min(len(frames), (t // WINDOW + 1) * WINDOW) - 1 if method == 'default' else t
                of_method.append(age(background, truth, since <= last))
            ages.setdefault(method, {})[name] = np.array(of_method)
    print(file=sys.stderr)
    return ages


def table(ages):
    names = list(next(iter(ages.values())))
    rows = []
    for method, of_method in ages.items():
        pairs = [(np.nanmean(a), np.nanmean(a[len(a) // 2:])) for a in of_method.values()]
        mean = np.mean(pairs, 0)
        rows.append([method, *(f'{a:.2f} / {b:.2f}' for a, b in pairs), f'**{mean[0]:.2f} / {mean[1]:.2f}**'])
    return page.table(['AGE, all frames / second half', *names, '**mean**'], rows)


def plot(ages, path):
    """The mean over the sequences; each is stretched to the same length."""
    figure, axes = plt.subplots(figsize=(8, 4))
    share = np.linspace(0, 1, 101)
    for method, of_method in ages.items():
        curves = [np.interp(share, np.linspace(0, 1, len(a))[~np.isnan(a)], a[~np.isnan(a)])
                  for a in of_method.values()]
        ours = method in SETTINGS
        axes.plot(100 * share, np.mean(curves, 0), label=method, linewidth=2.2 if ours else 1.2)
    axes.set_xlabel('frames seen, % of the sequence')
    axes.set_ylabel('AGE of what was seen, levels')
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.legend()
    figure.tight_layout()
    with plt.rc_context({'svg.hashsalt': 'qdmd'}):
        figure.savefig(path, metadata={'Date': None})


if __name__ == '__main__':
    results = measured()
    page.put(sys.argv[1], {'stream': table(results)})
    plot(results, sys.argv[2])
