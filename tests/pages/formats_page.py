# SPDX-License-Identifier: LGPL-2.1-or-later
"""What formats cost, and what 10 bits are good for: tables and a plot for docs/formats.md.

Usage: formats_page.py PAGE RESULTS IMAGES
"""
import os
import resource
import statistics
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt
import numpy

from page import figure, medians, put, table

# The benchmark's format, and those whose samples lie alike.
FORMATS = {'RGBA': 'RGBA BGRA ARGB ABGR, RGBx BGRx xRGB xBGR', 'RGB': 'RGB BGR', 'GBR': 'GBR', 'I420': 'I420 YV12',
           'NV12': 'NV12 NV21', 'A420': 'A420', 'Y42B': 'Y42B', 'NV16': 'NV16', 'YUY2': 'YUY2 UYVY', 'Y444': 'Y444',
           'AYUV': 'AYUV', 'GRAY8': 'GRAY8', 'I420_10LE': 'I420_10LE I420_12LE', 'I422_10LE': 'I422_10LE I422_12LE',
           'Y444_10LE': 'Y444_10LE Y444_12LE Y444_16LE', 'P010_10LE': 'P010_10LE P012_LE P016_LE',
           'GRAY16_LE': 'GRAY16_LE', 'RGBA64_LE': 'RGBA64_LE ARGB64'}
WORK = ['in', 'background', 'mask', 'cutout']

# Settings whose time with P010_10LE is held against that with NV12, in turns.
PAIRS = {'default': '', '`output=mask`': 'output=mask', '`mode=live output=mask`': 'mode=live output=mask',
         '`method=qdmd`': 'method=qdmd', '`method=qdmd mode=live output=mask`': 'method=qdmd mode=live output=mask'}
SIZE, FRAMES, TURNS = (768, 576), 150, 5

# The ramp: levels of 8 bits along a row, noise, and how a camera of 10 bits sees it.
WIDTH, HEIGHT, LONG = 512, 16, 50
LEVELS = 60 + numpy.arange(WIDTH) / 16
NOISE = 0.3


def launch(pipeline):
    """Seconds of computation."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(['gst-launch-1.0', '-q', *pipeline.split()], check=True, stdout=subprocess.DEVNULL)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def cost_table(path):
    cost = {}
    for run in medians(path):
        what, name = run['name'].split('/')[:2]
        cost[what, name] = run['ns_a_pixel']
    rows = [[names, *(f'{cost[what, name]:.2f}' for what in WORK)] for name, names in FORMATS.items()]
    return table(['formats', 'in', '`background`', '`mask`', '`cutout`'], rows)


def pairs_table(folder):
    width, height = SIZE
    sources = {}
    for name, size in ('NV12', 3 * width * height // 2), ('P010_10LE', 3 * width * height):
        raw = f'{folder}/{name}'
        launch(f'qdmdscenesrc scene=basic,noise=2 num-buffers={FRAMES} ! '
               f'video/x-raw,format={name},width={width},height={height} ! filesink location={raw}')
        sources[name] = (f'filesrc location={raw} blocksize={size} ! rawvideoparse '
                         f'format={name.lower().replace("_", "-")} width={width} height={height} framerate=25/1')
    elements = {'identity': 'identity', **{name: f'qdmdbackground {its}' for name, its in PAIRS.items()}}
    seconds = {}
    for _ in range(TURNS):
        for element, launched in elements.items():
            for name, source in sources.items():
                seconds.setdefault((element, name), []).append(launch(f'{source} ! {launched} ! fakesink sync=false'))
    rows = []
    for element in PAIRS:
        own = [1000 / FRAMES * (statistics.median(seconds[element, name]) -
                                statistics.median(seconds['identity', name])) for name in sources]
        rows.append([element, *(figure(each) for each in own), f'{own[1] / own[0]:.1f}'])
    return table(['`qdmdbackground`', 'NV12, ms a frame', 'P010_10LE, ms a frame', 'ratio'], rows)


def background_of(frames, depth, folder):
    """The luma of the first background of frames of Y444, in levels of 8 bits."""
    form, sample = ('y444-10le', '<u2') if depth > 8 else ('y444', 'u1')
    raw = numpy.full((len(frames), 3, HEIGHT, WIDTH), 1 << (depth - 1), sample)
    raw[:, 0] = frames
    raw.tofile(f'{folder}/in')
    launch(f'filesrc location={folder}/in blocksize={raw[0].nbytes} ! rawvideoparse format={form} width={WIDTH} '
           f'height={HEIGHT} framerate=25/1 ! qdmdbackground window-size={LONG} ! filesink location={folder}/out')
    return numpy.fromfile(f'{folder}/out', sample).reshape(raw.shape)[0, 0] / (1 << (depth - 8))


def plot_ramp(path):
    """Plots the ramp and its backgrounds; returns a sentence about their errors."""
    random = numpy.random.default_rng(21)
    noisy = LEVELS + random.normal(0, NOISE, (LONG, HEIGHT, WIDTH))
    deep = numpy.rint(4 * noisy)
    with tempfile.TemporaryDirectory() as folder:
        seen = {8: background_of(numpy.rint(deep / 4), 8, folder), 10: background_of(deep, 10, folder)}
    fig, (shades, errors) = plt.subplots(1, 2, figsize=(10, 3.4), layout='constrained')
    colours = {8: 'tab:red', 10: 'tab:blue'}
    part = slice(0, 96)
    shades.plot(LEVELS[part], color='black', linewidth=1, label='the ramp')
    for depth, picture in seen.items():
        shades.plot(picture[HEIGHT // 2][part], color=colours[depth], linewidth=1, label=f'background, {depth} bits')
        errors.plot((picture - LEVELS)[HEIGHT // 2], color=colours[depth], linewidth=0.8, label=f'{depth} bits')
    shades.set(xlabel='pixel', ylabel='level of 8 bits', title='a row of the background')
    errors.set(xlabel='pixel', ylabel='levels of 8 bits', title='its error')
    for edge in -0.5, 0.5:
        errors.axhline(edge, color='grey', linewidth=0.7, linestyle='--')
    shades.legend(), errors.legend(loc='upper right')
    fig.savefig(path, metadata={'Date': None})
    off = {depth: numpy.abs(picture - LEVELS) for depth, picture in seen.items()}
    return (f'*A ramp of {WIDTH} pixels that rises by {LEVELS[16] - LEVELS[0]:.0f} level of 8 bits in 16, with noise of '
            f'{NOISE} levels, as a camera of 10 bits sees it; {LONG} frames, the default method. With 10 bits the '
            f'background is off by {off[10].mean():.2f} levels on average and {off[10].max():.2f} at most, with the same '
            f'video in 8 bits by {off[8].mean():.2f} and {off[8].max():.2f}.*')


def main():
    if len(sys.argv) != 4:
        sys.exit('usage: formats_page.py PAGE RESULTS IMAGES')
    page, results, images = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        pairs = pairs_table(folder)
    put(page, {'formats': cost_table(os.path.join(results, 'cost.json')), 'deep formats': pairs,
               'ramp': plot_ramp(os.path.join(images, 'ramp.svg'))})


if __name__ == '__main__':
    main()
